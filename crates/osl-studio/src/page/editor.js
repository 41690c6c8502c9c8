// A text area in place of the source: changes the file of the page and saves it. While it is typed, the text is compiled
// and pictured in place of the file, and its errors are marked.
//
// A text is saved as a change of the version that was read. If the file has another version by then, the server
// refuses, and the reader decides.

import { fixed } from "./marks.js";

/** The end of the lines of a text; nothing if a text area would not keep them. */
function lineEnd(text) {
  const ends = new Set(text.match(/\r\n|\r|\n/g));
  return ends.size > 1 || ends.has("\r") ? null : ends.has("\r\n") ? "\r\n" : "\n";
}

/** Why a file cannot be edited; nothing if it can. */
function reasonAgainst(shader) {
  if (shader.locked) {
    return shader.locked;
  }
  if (lineEnd(shader.text) === null) {
    return "its lines end in ways that a text area does not keep";
  }
  return sizeOf(shader.text) > shader.max_message ? tooLarge(shader) : null;
}

/** The bytes that a text takes in a message, with room for the rest of the message. */
function sizeOf(text) {
  return new TextEncoder().encode(JSON.stringify(text)).length + 1024;
}

function tooLarge(shader) {
  return `the text is too large: a message from the page has at most ${shader.max_message / 1024} KiB`;
}

/** How long the keys rest before the text is shown, in milliseconds. */
const REST = 40;
/** What Tab inserts. */
const INDENT = "    ";

export class Editor {
  /** The parts are the text area, the buttons `edit`, `save`, `overwrite` and `discard`, and a `word`. `send(edit)`
   * asks the server to save, and is false if there is no connection; `live(file, text)` shows a text that is not saved,
   * or without one that of the file; `toggled(isOpen)` is called when the text area appears and when it goes; `top()` is
   * the first line that is seen; `marks` are under the text area. */
  constructor({ text, edit, save, overwrite, discard, word, send, live, toggled, top, marks }) {
    Object.assign(this, { area: text, buttons: { edit, save, overwrite, discard }, word, send, live, toggled, top, marks });
    this.isOpen = false;
    this.saving = null;
    this.theirs = null;
    edit.onclick = () => this.open();
    save.onclick = () => this.save(this.version);
    overwrite.onclick = () => this.save(this.theirs);
    discard.onclick = () => this.close();
    text.addEventListener("input", () => this.typed());
    text.addEventListener("keydown", (event) => this.typing(event));
    document.addEventListener("keydown", (event) => this.key(event));
    addEventListener("beforeunload", (event) => this.isChanged && event.preventDefault());
  }

  /** Whether there is a text that is not saved. */
  get isChanged() {
    return this.isOpen && this.area.value !== this.before;
  }

  /** Takes a shader that the server sent: for the next edit, and in place of a text that was not changed. */
  show(shader) {
    this.shader = shader;
    if (this.isOpen && shader.file === this.file) {
      this.marks.show(shader.diagnostics.filter((message) => message.file === shader.path));
    }
    const reason = reasonAgainst(shader);
    this.buttons.edit.disabled = reason !== null;
    this.buttons.edit.title = reason === null ? "Change the file: E" : `Not to be edited here: ${reason}`;
    const isSame = shader.file === this.file;
    if (!this.isOpen || (isSame && [this.version, this.theirs].includes(shader.version))) {
      return;
    }
    if (this.isChanged || this.saving !== null) {
      const what = isSame ? "The file has changed on the disk" : "The page shows another file";
      this.say(`${what}; your text is not saved.`, isSame ? shader.version : null);
    } else if (reason === null && isSame) {
      this.load();
      this.say("The file has changed on the disk.");
    } else {
      this.close();
    }
  }

  /** Puts the text of the file into the text area. */
  load() {
    const { shader, area } = this;
    const { selectionStart, selectionEnd, scrollTop } = area;
    this.file = shader.file;
    this.version = shader.version;
    this.end = lineEnd(shader.text);
    area.value = shader.text;
    // What the text area makes of the text, so that it can be compared.
    this.before = area.value;
    area.setSelectionRange(selectionStart, selectionEnd);
    area.scrollTop = scrollTop;
    this.marks.show(shader.diagnostics.filter((message) => message.file === shader.path));
  }

  /** The text has changed. */
  typed() {
    this.say("");
    this.marks.show();
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.again(), REST);
  }

  /** Shows the text that is not saved, if it can be sent. */
  again() {
    clearTimeout(this.timer);
    if (!this.isOpen) {
      return;
    }
    const text = this.area.value.replaceAll("\n", this.end);
    if (sizeOf(text) > this.shader.max_message) {
      this.say(`The picture is that of the file: ${tooLarge(this.shader)}.`);
    } else {
      this.isLive = this.isChanged;
      this.live(this.file, this.isChanged ? text : null);
    }
  }

  /** The file has its own text again. */
  settle() {
    clearTimeout(this.timer);
    if (this.isLive) {
      this.isLive = false;
      this.live(this.file, null);
    }
  }

  /** Changes the text as a fix says. The change can be undone like one that is typed. */
  fix(fix) {
    this.open();
    if (!this.isOpen) {
      return;
    }
    const { area } = this;
    const text = fixed(area.value, fix.edits);
    const from = [...text].findIndex((letter, at) => letter !== area.value[at]);
    area.focus();
    area.select();
    // The browser keeps what it undoes of a text that is inserted like this.
    if (!document.execCommand("insertText", false, text)) {
      area.value = text;
      this.typed();
    }
    area.setSelectionRange(Math.max(0, from), Math.max(0, from));
  }

  open() {
    if (this.isOpen || !this.shader || this.buttons.edit.disabled) {
      return;
    }
    const line = this.top();
    this.isOpen = true;
    this.area.hidden = false;
    this.toggled(true);
    this.load();
    this.goTo(line, false);
    this.say("");
  }

  /** Shows the source again. What is not saved is lost. */
  close() {
    const hadFocus = document.activeElement === this.area;
    this.settle();
    this.isOpen = false;
    this.area.hidden = true;
    this.area.value = "";
    this.toggled(false);
    this.say("");
    if (hadFocus) {
      this.buttons.edit.focus();
    }
  }

  /** Saves the text in place of a version of the file. */
  save(version) {
    if (!this.isOpen || this.saving !== null || (!this.isChanged && version === this.version)) {
      return;
    }
    const text = this.area.value.replaceAll("\n", this.end);
    if (sizeOf(text) > this.shader.max_message) {
      this.say(`Not saved: ${tooLarge(this.shader)}.`);
    } else if (this.send({ file: this.file, version, text })) {
      this.saving = this.area.value;
      this.say("saving…");
    } else {
      this.say("Not saved: the server does not answer.");
    }
  }

  /** Shows whether the text was saved. */
  answer({ saved, version, messages }) {
    const text = this.saving;
    this.saving = null;
    if (!this.isOpen || text === null) {
      return;
    }
    if (saved) {
      this.version = version;
      this.before = text;
      this.again();
      this.say("saved");
    } else {
      this.say(messages.map((message) => message.message).join("\n") || "not saved", version);
    }
  }

  /** The connection is lost, and with it the answer. */
  lost() {
    if (this.saving !== null) {
      this.saving = null;
      this.say("The server did not say whether the text is saved.");
    }
  }

  /** Says a word, and shows the buttons that make sense. With a version, the file has changed to it. */
  say(word, theirs = null) {
    const { edit, save, overwrite, discard } = this.buttons;
    this.theirs = theirs;
    this.warned = false;
    this.word.textContent = word;
    edit.hidden = this.isOpen;
    save.hidden = !this.isOpen || theirs !== null;
    save.disabled = !this.isChanged || this.saving !== null;
    overwrite.hidden = !this.isOpen || theirs === null;
    discard.hidden = !this.isOpen;
    discard.textContent = this.isChanged ? "Discard" : "Close";
  }

  /** Selects a line; without `selects`, only puts the cursor there. */
  goTo(line, selects = true) {
    const { area } = this;
    const lines = area.value.split("\n");
    const start = lines.slice(0, line - 1).reduce((sum, text) => sum + text.length + 1, 0);
    area.focus({ preventScroll: true });
    area.setSelectionRange(start, start + (selects ? lines[line - 1]?.length ?? 0 : 0));
    const height = parseFloat(getComputedStyle(area).lineHeight);
    area.scrollTop = Math.max(0, (line - 1) * height - (selects ? area.clientHeight / 2 : 0));
  }

  /** Escape goes back; the first one does not discard a change. */
  escape(event) {
    event.stopPropagation();
    if (this.isChanged && !this.warned) {
      this.say("Not saved: Escape once more discards the change.", this.theirs);
      this.warned = true;
    } else {
      this.close();
    }
  }

  /** Tab and Enter indent; Escape goes back. */
  typing(event) {
    const { area } = this;
    const hasCommand = event.ctrlKey || event.metaKey || event.altKey;
    if (event.key === "Escape") {
      this.escape(event);
    } else if (event.key === "Tab" && !event.shiftKey && !hasCommand) {
      event.preventDefault();
      document.execCommand("insertText", false, INDENT);
    } else if (event.key === "Enter" && !event.shiftKey && !hasCommand) {
      event.preventDefault();
      const before = area.value.slice(0, area.selectionStart);
      const [, indent] = before.slice(before.lastIndexOf("\n") + 1).match(/^(\s*)/);
      document.execCommand("insertText", false, `\n${indent}${before.trimEnd().endsWith("{") ? INDENT : ""}`);
    }
  }

  key(event) {
    const key = event.key.toLowerCase();
    const isTyping = event.target.matches?.("input, select, textarea");
    const hasCommand = event.ctrlKey || event.metaKey;
    if (this.isOpen && hasCommand && !event.altKey && key === "s") {
      event.preventDefault();
      this.save(this.version);
    } else if (!isTyping && !hasCommand && !event.altKey && key === "e" && !this.buttons.edit.disabled && !this.isOpen) {
      event.preventDefault();
      this.open();
    }
  }
}
