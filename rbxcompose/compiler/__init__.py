"""From manifests to a plan or to findings: composition, model, rules, plan, schemas, systems."""
