// What lies under the text area: the text in colors, the numbers of its lines, and marks at errors and warnings. The
// text area itself is transparent, so both must have the same font and the same places.

import { element } from "./element.js";
import { marked, messageText, severityClass } from "./source.js";

/** Columns of a tab, as in the style of the text area. */
const TAB = 8;

/** The column on the screen of a character of a line; a tab goes to the next multiple of eight. */
function screenColumn(text, character) {
  let column = 0;
  for (const letter of [...text].slice(0, character - 1)) {
    column += letter === "\t" ? TAB - (column % TAB) : 1;
  }
  return column;
}

/** The layers under the text area. */
export class Marks {
  /** `text` is the text area, `under` the layer with the colored text and the marks, `numbers` the one with the numbers. */
  constructor(text, under, numbers) {
    Object.assign(this, { text, under, numbers, messages: [], count: 0 });
    text.addEventListener("scroll", () => this.scroll());
  }

  /** Shows the text, with these messages of its file. */
  show(messages = this.messages) {
    this.messages = messages;
    const lines = this.text.value.split("\n");
    let inside = false;
    const colored = lines.flatMap((text) => {
      let parts;
      [parts, inside] = marked(text, inside);
      return [...parts, "\n"];
    });
    this.under.replaceChildren(...colored, ...messages.flatMap((message) => this.mark(message, lines)));
    if (this.count !== lines.length) {
      this.count = lines.length;
      this.numbers.replaceChildren(...lines.map((_, at) => element("div", {}, String(at + 1))));
    }
    for (const number of this.numbers.children) {
      number.removeAttribute("class");
      number.removeAttribute("title");
    }
    for (const message of messages) {
      const number = this.numbers.children[message.line - 1];
      if (number && number.className !== "error") {
        number.className = severityClass(message);
        number.title = messageText(message);
      }
    }
    this.scroll();
  }

  /** The mark of a message: from its first column to its last one on that line. */
  mark(message, lines) {
    const text = lines[message.line - 1];
    if (text === undefined) {
      return [];
    }
    const from = screenColumn(text, message.column ?? 1);
    const isOneLine = message.end_line === message.line;
    const to = screenColumn(text, isOneLine ? message.end_column : [...text].length + 1);
    const mark = element("span", { class: `mark ${severityClass(message)}` });
    const place = { line: message.line - 1, from, columns: Math.max(1, to - from) };
    Object.entries(place).forEach(([name, number]) => mark.style.setProperty(`--${name}`, number));
    return [mark];
  }

  scroll() {
    const { text, under, numbers } = this;
    under.style.transform = `translate(${-text.scrollLeft}px, ${-text.scrollTop}px)`;
    numbers.style.transform = `translateY(${-text.scrollTop}px)`;
  }
}

/** Applies the edits of a fix to a text: lines and columns are those of the text before. */
export function fixed(text, edits) {
  const starts = [0];
  for (const line of text.split("\n")) {
    starts.push(starts.at(-1) + line.length + 1);
  }
  const place = (line, column) => {
    const start = starts[line - 1] ?? text.length;
    const before = [...text.slice(start)].slice(0, column - 1).join("");
    return start + before.length;
  };
  const changes = edits.map((edit) => [place(edit.line, edit.column), place(edit.end_line, edit.end_column), edit.text]);
  changes.sort((a, b) => b[0] - a[0]);
  return changes.reduce((now, [from, to, word]) => now.slice(0, from) + word + now.slice(to), text);
}
