/** The text of a file that a person edits, with what is wrong marked in it: CodeMirror, below a root of its own. */
import { defaultKeymap, history, historyKeymap, redo, redoDepth, undo, undoDepth } from "@codemirror/commands";
import { yaml } from "@codemirror/lang-yaml";
import { HighlightStyle, indentOnInput, indentUnit, syntaxHighlighting } from "@codemirror/language";
import { Compartment, EditorState, StateEffect, StateField, type Range } from "@codemirror/state";
import {
  Decoration,
  drawSelection,
  EditorView,
  highlightActiveLine,
  keymap,
  lineNumbers,
  WidgetType,
  type DecorationSet,
} from "@codemirror/view";
import { tags } from "@lezer/highlight";
import type { Edit, Found } from "./edited";

const COLOURS = HighlightStyle.define([
  { tag: [tags.propertyName, tags.definition(tags.propertyName)], color: "var(--accent)" },
  { tag: tags.string, color: "var(--good)" },
  { tag: [tags.comment, tags.meta], color: "var(--faint)" },
]);

// A policy forbids styles within the page; what is below a root of its own has style sheets that are objects.
const LOOK = EditorView.theme({
  "&": { height: "100%", fontSize: "0.875rem", color: "var(--ink)", backgroundColor: "var(--card)" },
  "&.cm-focused": { outline: "3px solid var(--accent)", outlineOffset: "-3px" },
  ".cm-scroller": { fontFamily: "ui-monospace, 'DejaVu Sans Mono', monospace", lineHeight: "1.5" },
  ".cm-content": { caretColor: "var(--ink)" },
  ".cm-cursor": { borderLeftColor: "var(--ink)" },
  ".cm-gutters": { backgroundColor: "var(--card)", color: "var(--faint)", borderRight: "1px solid var(--line)" },
  ".cm-activeLine": { backgroundColor: "transparent", boxShadow: "inset 0 -1px var(--quiet), inset 0 1px var(--quiet)" },
  "&.cm-focused > .cm-scroller > .cm-selectionLayer .cm-selectionBackground, .cm-selectionBackground": {
    backgroundColor: "var(--quiet)",
  },
  ".cm-error, .cm-warning": { textDecoration: "underline wavy var(--bad)", textDecorationSkipInk: "none" },
  ".cm-warning": { textDecorationColor: "var(--fair)" },
  ".cm-block": { backgroundColor: "var(--quiet)" },
  ".cm-says": { paddingLeft: "2ch", fontFamily: "system-ui, sans-serif", fontSize: "0.8125rem", color: "var(--bad)" },
  ".cm-says.warning": { color: "var(--fair)" },
});

/** What is wrong, at the end of its line. */
class Words extends WidgetType {
  readonly text: string;
  readonly severity: string;

  constructor(text: string, severity: string) {
    super();
    this.text = text;
    this.severity = severity;
  }

  override eq(other: Words): boolean {
    return other.text === this.text && other.severity === this.severity;
  }

  toDOM(): HTMLElement {
    const element = document.createElement("span");
    element.className = `cm-says ${this.severity}`;
    element.textContent = this.text;
    return element;
  }
}

const setMarks = StateEffect.define<DecorationSet>();
const marks = StateField.define<DecorationSet>({
  create: () => Decoration.none,
  update(old, transaction) {
    for (const effect of transaction.effects) if (effect.is(setMarks)) return effect.value;
    return old.map(transaction.changes);
  },
  provide: (field) => EditorView.decorations.from(field),
});

export class TextEditor {
  readonly element = document.createElement("div");
  readonly #view: EditorView;
  readonly #access = new Compartment();
  #found: readonly Found[] = [];
  #isShowing = false;
  #block: { from: number; to: number } | null = null;

  /** `onChange` is called after each change of the text, `onMove` when the cursor was moved. */
  constructor(label: string, text: string, onChange: () => void, onMove: (at: number) => void) {
    const root = this.element.attachShadow({ mode: "open" });
    this.#view = new EditorView({
      root,
      parent: root,
      state: EditorState.create({
        doc: text,
        extensions: [
          lineNumbers(),
          history(),
          drawSelection(),
          highlightActiveLine(),
          indentOnInput(),
          indentUnit.of("  "),
          EditorState.tabSize.of(2),
          yaml(),
          syntaxHighlighting(COLOURS),
          LOOK,
          marks,
          keymap.of([...defaultKeymap, ...historyKeymap]),
          EditorView.lineWrapping,
          EditorView.contentAttributes.of({ "aria-label": label }),
          this.#access.of(EditorState.readOnly.of(false)),
          EditorView.updateListener.of((update) => {
            if (update.docChanged) onChange();
            else if (update.selectionSet && !this.#isShowing) onMove(update.state.selection.main.head);
          }),
        ],
      }),
    });
  }

  get text(): string {
    return this.#view.state.doc.toString();
  }

  get cursor(): number {
    return this.#view.state.selection.main.head;
  }

  get canUndo(): boolean {
    return undoDepth(this.#view.state) > 0;
  }

  get canRedo(): boolean {
    return redoDepth(this.#view.state) > 0;
  }

  undo(): void {
    undo(this.#view);
  }

  redo(): void {
    redo(this.#view);
  }

  close(): void {
    this.#view.destroy();
  }

  focus(): void {
    this.#view.focus();
  }

  allow(isAllowed: boolean): void {
    this.#view.dispatch({ effects: this.#access.reconfigure(EditorState.readOnly.of(!isAllowed)) });
  }

  /** Replaces the whole text; `undo` brings the old one back. */
  replace(text: string): void {
    this.edit([{ from: 0, to: this.#view.state.doc.length, text }]);
  }

  /** Changes parts of the text, all at once. */
  edit(edits: readonly Edit[]): void {
    this.#view.dispatch({ changes: edits.map(({ from, to, text }) => ({ from, to, insert: text })), userEvent: "input" });
  }

  /** Shows a place, and puts the cursor there. */
  show(from: number, to = from): void {
    const most = this.#view.state.doc.length;
    const anchor = Math.min(from, most);
    this.#isShowing = to > from;
    this.#view.dispatch({ selection: { anchor }, effects: EditorView.scrollIntoView(anchor, { y: "center" }) });
    this.#isShowing = false;
    this.#block = to > from ? { from: anchor, to: Math.min(to, most) } : null;
    this.#mark();
  }

  hideBlock(): void {
    if (!this.#block) return;
    this.#block = null;
    this.#mark();
  }

  /** Marks what is wrong with the text as it is now. */
  mark(found: readonly Found[]): void {
    this.#found = found;
    this.#mark();
  }

  #mark(): void {
    const { doc } = this.#view.state;
    const ranges: Range<Decoration>[] = [];
    const told = new Set<number>();
    for (const { from, to, severity, message } of this.#found) {
      if (from > doc.length) continue;
      const line = doc.lineAt(from);
      const end = Math.min(Math.max(to, from + 1), line.to);
      if (end > from) ranges.push(Decoration.mark({ class: `cm-${severity}` }).range(from, end));
      if (told.has(line.number)) continue;
      told.add(line.number);
      ranges.push(Decoration.widget({ widget: new Words(message, severity), side: 1 }).range(line.to));
    }
    if (this.#block) {
      const last = doc.lineAt(Math.min(Math.max(this.#block.to - 1, this.#block.from), doc.length)).number;
      for (let number = doc.lineAt(Math.min(this.#block.from, doc.length)).number; number <= last; number += 1) {
        ranges.push(Decoration.line({ class: "cm-block" }).range(doc.line(number).from));
      }
    }
    if (ranges.length === 0 && this.#view.state.field(marks).size === 0) return;
    this.#view.dispatch({ effects: setMarks.of(Decoration.set(ranges, true)) });
  }
}
