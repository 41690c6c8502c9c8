// The source of the shader, with its messages at their lines, and with the values of the pixel that is explained.

import { element } from "./element.js";

// The words that stand out, so that the structure of a shader is seen at a glance.
const WORDS = new Set(("shader surface displacement volume float int color point vector normal matrix string void closure "
  + "struct output public if else for while do break continue return").split(" "));
const TOKEN = /(\/\/.*$|"(?:[^"\\]|\\.)*"?|[A-Za-z_]\w*|[^A-Za-z_"/]+|\/)/g;

/** The parts of a line, with comments, strings and words marked. `inside` says whether it begins in a comment. */
function marked(text, inside) {
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
  constructor(pane, list) {
    this.pane = pane;
    this.list = list;
    this.lines = [];
  }

  /** Shows the text of a shader with its messages. */
  show(shader) {
    const top = this.pane.scrollTop;
    this.path = shader.path;
    let inside = false;
    this.lines = shader.text.split(/\r?\n/).map((text, at) => {
      let parts;
      [parts, inside] = marked(text, inside);
      return element("div", { class: "line-box" },
        element("div", { class: "line" },
          element("span", { class: "number" }, String(at + 1)),
          element("span", { class: "code" }, ...parts)));
    });
    this.pane.replaceChildren(...this.lines);
    this.pane.scrollTop = top;
    this.listMessages(shader.diagnostics);
    this.annotate(shader.diagnostics, "checked");
    const first = shader.diagnostics.find((message) => message.severity === "error" && this.lineOf(message));
    if (first) {
      this.lineOf(first).scrollIntoView({ block: "nearest" });
    }
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
      this.lineOf(message)?.append(element("div", attributes, messageText(message)));
    }
  }

  /** Lists the errors above the source, each as a link to its line; and how many warnings there are. */
  listMessages(messages) {
    const errors = messages.filter((message) => message.severity === "error");
    const others = messages.length - errors.length;
    const items = errors.map((message) => {
      const place = message.file ? `${message.file}:${message.line}: ` : "";
      const link = element("button", { type: "button", class: "link" }, place + messageText(message));
      link.onclick = () => this.lineOf(message)?.scrollIntoView({ block: "center" });
      return element("li", { class: "error" }, link);
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
