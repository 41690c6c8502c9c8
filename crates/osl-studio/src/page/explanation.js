// What the shader does at one pixel: texts below the lines of the source, and the globals and outputs below the
// picture.

import { element } from "./element.js";

const MOST_VALUES = 6;

/** A number with at most six digits. */
function number(value) {
  return typeof value === "number" ? String(Number(value.toPrecision(6))) : String(value);
}

/** A value as `oslrun explain` shows it. */
function shown({ value, closure }) {
  // A closure is its text.
  if (closure) {
    return value;
  }
  if (Array.isArray(value)) {
    return `(${value.map(number).join(" ")})`;
  }
  return typeof value === "string" ? JSON.stringify(value) : value === null ? "none" : number(value);
}

function list(values, text) {
  const first = values.slice(0, MOST_VALUES).map(text).join(", ");
  return values.length > MOST_VALUES ? `${first}, … (${values.length} values)` : first;
}

/** How many decimal digits are lost at worst, if that is worth a word. */
function lost(values) {
  const digits = values.map((value) => value.digits).filter((digits) => typeof digits === "number");
  const fewest = Math.min(...digits);
  return fewest < 5 ? `   (${Math.max(0, fewest).toFixed(0)} digits are right)` : "";
}

/** The text of a fact, or nothing. */
function factText(fact) {
  switch (fact.fact) {
    case "set":
      return `${fact.name} = ${list(fact.values, shown)}${lost(fact.values)}`;
    case "branch": {
      const yes = fact.taken.filter(Boolean).length;
      const count = fact.taken.length;
      const words = yes === count ? "true" : yes === 0 ? "false" : `true ${yes} of ${count} times`;
      return `${fact.condition}: ${words}`;
    }
    case "unevaluated":
      return `${fact.condition}: not evaluated`;
    case "rounds":
      return `${list(fact.counts, String)} rounds`;
    default:
      return null;
  }
}

/** The texts for the lines of a file. */
export function lineTexts(explanation, path) {
  const lines = explanation.lines.filter((line) => line.file === path);
  return lines.map((line) => {
    const texts = line.facts.map(factText).filter(Boolean);
    if (line.state === "skipped") {
      texts.push("not reached");
    }
    return [line.number, [...new Set(texts)]];
  }).filter(([, texts]) => texts.length > 0);
}

/** Shows the place, the outputs and the globals. */
export function showExplanation(pane, message) {
  const [x, y] = message.at;
  const { explanation } = message;
  if (!explanation) {
    const why = message.messages.map((found) => found.message).join("\n");
    pane.replaceChildren(element("p", {}, `pixel (${x}, ${y})`), element("p", { class: "dim" }, why));
    return;
  }
  const row = ([name, value]) => element("tr", {}, element("td", {}, name), element("td", {}, shown(value)));
  pane.replaceChildren(
    element("p", {}, `pixel (${x}, ${y})`),
    element("table", {}, ...explanation.outputs.map(row)),
    element("p", { class: "dim" }, explanation.globals.map(([name, value]) => `${name} = ${shown(value)}`).join("   ")));
}
