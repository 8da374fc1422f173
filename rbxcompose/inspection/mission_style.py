"""The style of a mission's page."""

STYLE = """
:root{--page:#fff;--text:#1f2328;--soft:#59636e;--edge:#d0d7de;--body:#fff;--group:#f6f8fa;
--running:#0969da;--success:#1a7f37;--failure:#cf222e;--skipped:#818b98;--state:#8250df}
@media(prefers-color-scheme:dark){:root{--page:#0d1117;--text:#e6edf3;--soft:#9198a1;--edge:#3d444d;--body:#212830;
--group:#151b23;--running:#4493f8;--success:#3fb950;--failure:#f85149;--skipped:#9198a1;--state:#ab7df8}}
*{box-sizing:border-box}body{margin:0;padding:20px 24px;background:var(--page);color:var(--text);
font:13px/1.35 system-ui,sans-serif}
h1{margin:0;font-size:22px}h2{font-size:15px;margin:20px 0 8px;color:var(--soft)}
header p{margin:2px 0 10px;color:var(--soft)}.legend{display:flex;gap:18px}
.box{border:1px solid var(--edge);border-left-width:4px;border-radius:7px;background:var(--body);max-width:100%}
.box.group{background:var(--group)}.group .group{background:var(--body)}.group .group .group{background:var(--group)}
.box.running{border-color:var(--running)}.box.success{border-color:var(--success)}
.box.failure{border-color:var(--failure)}.box.skipped{border-style:dashed}
.running>.head .mark,.legend .running{color:var(--running)}.success>.head .mark,.legend .success{color:var(--success)}
.failure>.head .mark,.legend .failure{color:var(--failure)}.skipped>.head .mark{color:var(--skipped)}
.box.running>.head{background:color-mix(in srgb,var(--running) 13%,transparent);border-radius:4px}
.head{display:flex;flex-wrap:wrap;gap:3px 7px;align-items:baseline;padding:4px 9px}
.kind{color:var(--soft)}.leaf>.head .kind{color:var(--text)}.sign{font-style:normal;color:var(--soft)}
.text{font-weight:600;overflow-wrap:anywhere}.name{color:var(--state)}
.note,.lead{font-size:11px;color:var(--soft);border:1px solid var(--edge);border-radius:9px;padding:0 7px}
.lead{border-color:var(--state)}
.inside{display:flex;flex-wrap:wrap;gap:7px 7px;padding:2px 8px 8px;align-items:flex-start}
.inside.after>.box:not(:last-child){margin-right:15px;position:relative}
.inside.after>.box:not(:last-child)::after{content:"→";position:absolute;right:-19px;top:3px;color:var(--soft)}
.fallback>.inside.after>.box:not(:last-child)::after{content:"?";right:-16px}
.machine>.inside{flex-direction:column;align-items:stretch}
.interrupts{display:flex;flex-wrap:wrap;gap:9px;align-items:flex-start}
svg.states{display:block;margin:2px 8px 8px;max-width:100%;overflow:visible}
svg text{font:12px system-ui,sans-serif;fill:var(--text);text-anchor:middle}
g.state rect{fill:var(--body);stroke:var(--state);stroke-width:1.4}g.state.start rect{stroke-width:3}
g.state text{font-weight:600}g.state.end rect{stroke:var(--soft);stroke-dasharray:4 2}
g.state.running rect{stroke:var(--running);fill:color-mix(in srgb,var(--running) 18%,var(--body));stroke-width:3}
g.state.success rect{stroke:var(--success)}g.state.failure rect{stroke:var(--failure)}
.pill rect{fill:var(--page);stroke:var(--edge)}.pill text{font-size:11px;fill:var(--soft)}
.line{fill:none;stroke:var(--soft);stroke-width:1.3}
"""
