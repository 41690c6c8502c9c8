// What a line of the source does: small pictures of the variables that it sets, of its conditions and loops. A
// click on a variable makes it the output of the picture: a tap, such as `42:dist`.

import { element } from "./element.js";

/** Whether an output is a tap. No output of a shader has a colon in its name. */
export function isTap(output) {
  return Boolean(output?.includes(":"));
}

/** Where a line is after a change of the text: the closest line with its text, or the one in its place. */
export function movedLine(line, before, after) {
  const [from, to] = [before.split("\n"), after.split("\n")];
  let last = 0;
  while (last < Math.min(from.length, to.length) && from[from.length - 1 - last] === to[to.length - 1 - last]) {
    last += 1;
  }
  // All lines from this one on are as they were.
  if (line > from.length - last) {
    return line + to.length - from.length;
  }
  const same = to.flatMap((text, at) => (text === from[line - 1] ? [at + 1] : []));
  const distance = (at) => Math.abs(at - line);
  return same.reduce((best, at) => (distance(at) < distance(best) ? at : best), same[0] ?? line);
}

/** The same tap after a change of the text. */
export function movedTap(tap, before, after) {
  return tap.replace(/^\d+(?=:)/, (line) => movedLine(Number(line), before, after));
}

/** The pane with the pictures of a line. */
export class TapPane {
  /** `ask(line)` asks for the pictures of a line, `choose(tap, range)` makes one of them the output. */
  constructor(pane, { ask, choose }) {
    Object.assign(this, { pane, ask, choose, line: null, output: null });
  }

  /** Shows another line as soon as its pictures come. */
  point(line) {
    if (line !== this.line) {
      this.line = line;
      this.again();
    }
  }

  /** Asks for the pictures of the same line again: the state has changed. */
  again() {
    if (this.line) {
      this.ask(this.line);
    }
  }

  /** Shows no line. */
  close() {
    this.line = null;
    this.pane.replaceChildren();
    this.pane.hidden = true;
  }

  /** Shows an answer, unless it is outdated. */
  answer({ line, pictures, more, messages }) {
    if (line !== this.line || (!pictures && messages.length === 0)) {
      return;
    }
    const focused = this.pane.contains(document.activeElement) ? document.activeElement.dataset.tap : null;
    const close = element("button", { type: "button", class: "link", "aria-label": "Close" }, "×");
    close.onclick = () => this.close();
    const bar = element("div", { class: "bar" }, element("h2", {}, `Line ${line}`), close);
    this.pane.hidden = false;
    this.pane.replaceChildren(bar, this.list(pictures, messages));
    if (more) {
      this.pane.append(element("p", { class: "dim" }, `${more} more are left out`));
    }
    this.mark();
    this.pane.querySelector(`[data-tap="${CSS.escape(focused ?? "")}"]`)?.focus();
  }

  list(pictures, messages) {
    if (!pictures) {
      return element("p", { class: "error" }, messages.map((message) => message.message).join("\n"));
    }
    if (pictures.length === 0) {
      return element("p", { class: "dim" }, "This line sets no variable that has a picture.");
    }
    return element("ul", {}, ...pictures.map((picture) => element("li", {}, this.thumbnail(picture))));
  }

  thumbnail({ tap, name, type, words, range, picture, rounds }) {
    const image = (src, alt) => element("img", { src, alt });
    const shown = picture ? image(picture, "") : element("span", { class: "even" }, "=");
    const title = element("span", {}, element("span", { class: "dim" }, type), " ", element("span", { class: "name" }, name));
    const parts = [shown, title, element("span", { class: "dim" }, words)];
    if (rounds.length) {
      parts.push(element("span", { class: "rounds" }, "first: ", ...rounds.map((src, at) => image(src, `round ${at + 1}`))));
    }
    if (!tap) {
      return element("div", { class: "thumbnail" }, ...parts);
    }
    const attributes = { type: "button", class: "thumbnail", "data-tap": tap, title: `Show in the picture: --tap ${tap}` };
    const button = element("button", attributes, ...parts);
    button.onclick = () => this.choose(tap, range);
    return button;
  }

  /** Marks the picture of the output. */
  chosen(output) {
    this.output = output;
    this.mark();
  }

  mark() {
    for (const button of this.pane.querySelectorAll("[data-tap]")) {
      button.setAttribute("aria-pressed", String(button.dataset.tap === this.output));
    }
  }
}
