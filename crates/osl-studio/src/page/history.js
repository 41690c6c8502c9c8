// Undo and redo of changes of parameters.

export class History {
  /** `restore(params)` shows other values. The buttons are disabled when there is nothing to undo or to redo. */
  constructor({ undo, redo, restore }) {
    Object.assign(this, { undoButton: undo, redoButton: redo, restore });
    undo.onclick = () => this.undo();
    redo.onclick = () => this.redo();
    document.addEventListener("keydown", (event) => this.key(event));
    this.clear();
  }

  /** Forgets all changes. */
  clear() {
    this.done = [];
    this.undone = [];
    this.end();
    this.mark();
  }

  /** The next change is one of its own. */
  end() {
    this.name = null;
  }

  /** Remembers a change: the values before and after it, and the name of the parameter; none if it is several.
   * Changes of the same parameter are one until `end` is called. */
  add(before, after, name) {
    if (name && name === this.name) {
      this.done.at(-1).after = after;
    } else {
      this.done.push({ before, after });
    }
    this.undone = [];
    this.name = name;
    this.mark();
  }

  undo() {
    this.move(this.done, this.undone, "before");
  }

  redo() {
    this.move(this.undone, this.done, "after");
  }

  move(from, to, side) {
    const change = from.pop();
    if (change) {
      to.push(change);
      this.end();
      this.mark();
      this.restore(change[side]);
    }
  }

  mark() {
    this.undoButton.disabled = this.done.length === 0;
    this.redoButton.disabled = this.undone.length === 0;
  }

  key(event) {
    const key = event.key.toLowerCase();
    const isUndo = key === "z" && !event.shiftKey;
    const isRedo = (key === "z" && event.shiftKey) || key === "y";
    // A text is a value only when it is complete; until then the browser undoes what is typed.
    if (!(event.ctrlKey || event.metaKey) || event.altKey || !(isUndo || isRedo) || event.target.matches?.("input[type=text], textarea")) {
      return;
    }
    event.preventDefault();
    isUndo ? this.undo() : this.redo();
  }
}
