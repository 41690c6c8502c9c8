// The source of the shader, with its messages at their lines, and with the values of the pixel that is explained.
// Lines that set variables can be pointed at, with the mouse or the keys.

import { element } from "./element.js";

// The words that stand out, so that the structure of a shader is seen at a glance.
const WORDS = new Set(("shader surface displacement volume float int color point vector normal matrix string void closure "
  + "struct output public if else for while do break continue return").split(" "));
// How long the mouse is to rest on a line, in milliseconds, so that it can cross others.
const REST = 150;
const TOKEN = /(\/\/.*$|"(?:[^"\\]|\\.)*"?|[A-Za-z_]\w*|[^A-Za-z_"/]+|\/)/g;

/** The parts of a line, with comments, strings and words marked. `inside` says whether it begins in a comment. */
export function marked(text, inside) {
  const parts = [];
  let rest = text;
  while (rest) {
    const end = inside ? rest.indexOf("*/") : rest.indexOf("/*");
    const to = end < 0 ? rest.length : end + (inside ? 2 : 0);
    const piece = rest.slice(0, to);
    if (inside) {
      parts.push(element("span", { class: "comment" }, piece));
    } else if (!piece.includes("//") || end < 0) {
      for (const [token] of piece.matchAll(TOKEN)) {
        const kind = token.startsWith("//") ? "comment" : token.startsWith("\"") ? "text" : WORDS.has(token) ? "word" : null;
        parts.push(kind ? element("span", { class: kind }, token) : token);
      }
    } else {
      // The comment begins in a comment to the end of the line.
      parts.push(element("span", { class: "comment" }, rest));
      return [parts, false];
    }
    rest = rest.slice(to);
    if (end >= 0) {
      inside = !inside;
    }
  }
  return [parts, inside];
}

/** The text of a message. */
export function messageText(message) {
  const name = message.name && message.name !== "while-shading" ? ` (${message.name})` : "";
  const points = typeof message.points === "number" ? `, at ${message.points} of ${message.of} points` : "";
  const help = message.help ? `; ${message.help}` : "";
  return `${message.severity}: ${message.message}${name}${points}${help}`;
}

/** The style of a message. */
export function severityClass(message) {
  return message.severity === "error" ? "error" : message.severity === "warning" ? "warning" : "dim";
}

/** The pane with the source. */
export class SourcePane {
  /** `pointed(line)` is called when another line is chosen that does something; `revealed(line)` when the line of
   * a message is to be seen, and is false if it is to be seen here; `fix(fix)` when the fix of a message is wanted. */
  constructor(pane, list, pointed, revealed, fix) {
    this.pane = pane;
    this.list = list;
    this.pointed = pointed;
    this.revealed = revealed;
    this.fix = fix;
    this.lines = [];
    this.held = null;
    pane.addEventListener("pointerover", (event) => this.pointAt(event));
    pane.addEventListener("pointerleave", () => clearTimeout(this.timer));
    pane.addEventListener("focusin", (event) => this.focused(event.target));
    pane.addEventListener("click", (event) => this.hold(event.target));
    pane.addEventListener("keydown", (event) => this.key(event));
  }

  /** The number of the line of an element, if the line does something. */
  numberOf(part) {
    const button = part.closest(".line-box")?.querySelector("button.number");
    return button ? Number(button.textContent) : null;
  }

  pointAt(event) {
    // Lines that move under a mouse at rest, after a change of the file, are not pointed at.
    const place = `${event.clientX} ${event.clientY}`;
    if (place === this.place) {
      return;
    }
    this.place = place;
    clearTimeout(this.timer);
    const line = this.numberOf(event.target);
    if (line && !this.held) {
      this.timer = setTimeout(() => this.pointed(line), REST);
    }
  }

  /** A line that gets the focus by the keys is shown at once. */
  focused(part) {
    if (part.matches("button.number")) {
      this.pane.querySelector("button.number[tabindex='0']")?.setAttribute("tabindex", "-1");
      part.setAttribute("tabindex", "0");
      if (!this.held) {
        clearTimeout(this.timer);
        this.pointed(this.numberOf(part));
      }
    }
  }

  /** A click on the number of a line holds it: the mouse can move without a change. */
  hold(part) {
    if (part.matches("button.number")) {
      const line = this.numberOf(part);
      this.held = this.held === line ? null : line;
      this.markHeld();
      this.pointed(line);
    }
  }

  /** Holds no line. */
  release() {
    this.held = null;
    this.markHeld();
  }

  markHeld() {
    for (const button of this.pane.querySelectorAll("button.number")) {
      button.setAttribute("aria-pressed", String(Number(button.textContent) === this.held));
    }
  }

  /** The arrow keys go from one line that does something to the next. */
  key(event) {
    const step = { ArrowUp: -1, ArrowDown: 1 }[event.key];
    if (step && event.target.matches("button.number")) {
      event.preventDefault();
      const all = [...this.pane.querySelectorAll("button.number")];
      all[all.indexOf(event.target) + step]?.focus();
    }
  }

  /** The number of a line; a button if the line does something. */
  number(line, does) {
    if (!does.has(line)) {
      return element("span", { class: "number" }, String(line));
    }
    const label = `Line ${line}: show what it sets`;
    const attributes = { type: "button", class: "number", tabindex: "-1", "aria-label": label, title: "Hold this line" };
    return element("button", attributes, String(line));
  }

  /** Shows the text of a shader with its messages. */
  show(shader) {
    const top = this.pane.scrollTop;
    const focused = this.numberOf(document.activeElement);
    this.path = shader.path;
    this.lessons = shader.lessons;
    const does = new Set(shader.lines);
    let inside = false;
    this.lines = shader.text.split(/\r?\n/).map((text, at) => {
      let parts;
      [parts, inside] = marked(text, inside);
      return element("div", { class: "line-box" },
        element("div", { class: "line" },
          this.number(at + 1, does),
          element("span", { class: "code" }, ...parts)));
    });
    this.pane.replaceChildren(...this.lines);
    this.pane.scrollTop = top;
    this.pane.querySelector("button.number")?.setAttribute("tabindex", "0");
    this.markHeld();
    this.lines[focused - 1]?.querySelector("button.number")?.focus({ preventScroll: true });
    this.listMessages(shader.diagnostics, shader.unsaved);
    this.annotate(shader.unsaved ? [] : shader.diagnostics, "checked");
    const first = !shader.unsaved && shader.diagnostics.find((message) => message.severity === "error" && this.lineOf(message));
    if (first) {
      this.lineOf(first).scrollIntoView({ block: "nearest" });
    }
  }

  /** The number of the first line that is seen. */
  get topLine() {
    const top = this.pane.getBoundingClientRect().top;
    return this.lines.findIndex((line) => line.getBoundingClientRect().bottom > top) + 1 || 1;
  }

  lineOf(message) {
    return message.file === this.path ? this.lines[message.line - 1] : undefined;
  }

  /** Puts messages below their lines, in place of earlier ones of the same kind. */
  annotate(messages, kind) {
    for (const note of this.pane.querySelectorAll(`.note[data-kind=${kind}]`)) {
      note.remove();
    }
    for (const message of messages) {
      const attributes = { class: `note ${severityClass(message)}`, "data-kind": kind };
      const parts = [messageText(message), ...this.fixes(message), ...this.lesson(message)];
      this.lineOf(message)?.append(element("div", attributes, ...parts));
    }
  }

  /** A button for each fix that changes the file that is shown. */
  fixes(message) {
    const own = (message.fixes ?? []).filter((fix) => fix.edits.length > 0 && fix.edits.every((edit) => edit.file === this.path));
    return own.map((fix) => {
      const button = element("button", { type: "button", class: "fix", title: "Change the text; Save keeps it" }, `Fix: ${fix.title}`);
      button.onclick = () => this.fix(fix);
      return button;
    });
  }

  /** The lesson of a message, which opens when it is asked for. */
  lesson(message) {
    const text = this.lessons?.[message.code];
    return text ? [element("details", { class: "lesson" }, element("summary", {}, `Lesson ${message.code}`), element("pre", {}, text))] : [];
  }

  /** Lists the errors above the source, each as a link to its line, and how many warnings there are; with `all`, each
   * of these too. */
  listMessages(messages, all = false) {
    const errors = messages.filter((message) => all || message.severity === "error");
    const others = messages.length - errors.length;
    const items = errors.map((message) => {
      const place = message.file ? `${message.file}:${message.line}: ` : "";
      const link = element("button", { type: "button", class: "link" }, place + messageText(message));
      link.onclick = () => {
        const line = this.lineOf(message);
        if (line && !this.revealed(message.line)) {
          line.scrollIntoView({ block: "center" });
        }
      };
      return element("li", { class: severityClass(message) }, link, ...this.fixes(message), ...(all ? this.lesson(message) : []));
    });
    if (others) {
      items.push(element("li", { class: "warning" }, `${others} ${others === 1 ? "warning" : "warnings"}, at the lines`));
    }
    this.list.replaceChildren(...items);
  }

  /** Shows texts below lines: the values at the pixel that is explained. */
  values(byLine) {
    for (const value of this.pane.querySelectorAll(".value")) {
      value.remove();
    }
    const top = this.pane.scrollTop;
    for (const [number, texts] of byLine) {
      const line = this.lines[number - 1];
      line?.append(...texts.map((text) => element("div", { class: "value" }, text)));
    }
    this.pane.scrollTop = top;
  }
}
