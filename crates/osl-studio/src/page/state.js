// What is shown: the file, the output, the surface, the range, the layer, the error, the values of parameters, and the part of
// the picture that is seen, kept in the fragment of the address, so that a reload or a copied address shows the same.

import { isTap } from "./taps.js";

/** The parts of a state that are texts. */
const NAMES = ["file", "output", "on", "range", "layer", "max_error", "view"];

/** The layer with the difference to a pinned picture. It is not in the address, because the pinned picture is not. */
export const DIFFERENCE = "difference";

/** The state in the fragment; what it does not name is left to the server. */
export function readFragment() {
  const found = new URLSearchParams(location.hash.slice(1));
  const state = {};
  for (const name of NAMES) {
    if (found.has(name)) {
      state[name] = found.get(name);
    }
  }
  if (found.has("lit")) {
    state.lit = true;
  }
  if (found.has("p") || found.has("file")) {
    state.params = found.getAll("p").filter((text) => text.includes("=")).map((text) => {
      const at = text.indexOf("=");
      return [text.slice(0, at), text.slice(at + 1)];
    });
  }
  return state;
}

/** How long the fragment may be out of date, in milliseconds. */
const DELAY = 300;
let waiting = null;
let timer = null;

/** Writes the state to the fragment soon. Not at once: it takes some milliseconds, in which a picture can be made,
 * and browsers refuse it if it comes too often. */
export function writeFragmentSoon(state) {
  waiting = state;
  timer ??= setTimeout(flushFragment, DELAY);
}

/** Writes the state that waits. */
export function flushFragment() {
  clearTimeout(timer);
  timer = null;
  if (waiting) {
    writeFragment(waiting);
    waiting = null;
  }
}

addEventListener("pagehide", flushFragment);

/** Writes the state to the fragment, without an entry in the history. */
function writeFragment(state) {
  const fragment = new URLSearchParams();
  for (const name of NAMES) {
    if (state[name] && !(name === "layer" && state.layer === DIFFERENCE)) {
      fragment.set(name, state[name]);
    }
  }
  if (state.lit) {
    fragment.set("lit", "1");
  }
  for (const [name, value] of state.params ?? []) {
    fragment.append("p", `${name}=${value}`);
  }
  history.replaceState(null, "", `#${fragment}`);
}

/** A word of a command line for a shell. */
function word(text) {
  return /^[\w@%+=:,./-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`;
}

/** The options without those that the range of a state replaces. */
function withoutRange(options) {
  const isAfter = (at) => ["--range", "--exposure"].includes(options[at - 1]);
  return options.filter((option, at) => !isAfter(at) && !/^--(range|exposure|signed)(=|$)/.test(option));
}

/** Options that an error bound replaces, and those of them that have no value. */
const SAMPLED = ["--max-error", "--adaptive", "--within", "--shading-rate", "--prefilter"];
const ALONE = ["--prefilter"];

function isOneOf(names, option) {
  return names.some((name) => option === name || option?.startsWith(`${name}=`));
}

/** Whether the command line gives the pixels other numbers of samples than one; with `differ`, whether these
 * differ from pixel to pixel. */
export function isSampled(shader, differ = false) {
  const names = differ ? ["--max-error", "--adaptive"] : [...SAMPLED, "--samples"];
  return Boolean(shader?.command.some((option) => isOneOf(names, option)));
}

/** The options without those that the error bound of a state replaces. */
function withoutSampling(options) {
  const hasValue = (option) => SAMPLED.includes(option) && !ALONE.includes(option);
  return options.filter((option, at) => !isOneOf(SAMPLED, option) && !hasValue(options[at - 1]));
}

function line(shader, state, params, ending) {
  const [program, ...given] = shader.command;
  const range = state.lit ? undefined : state.range;
  const options = state.max_error ? [...withoutSampling(given), "--max-error", state.max_error] : given;
  const words = [program, shader.path, ...(range ? [...withoutRange(options), "--range", range] : options)];
  const output = state.output ?? shader.output;
  const isColor = shader.outputs.some((one) => one.name === output && one.type === "color");
  if (state.lit) {
    words.push("--preview", ...(isColor ? ["--base", output] : []));
  } else if (output) {
    words.push(isTap(output) ? "--tap" : "--outputs", output);
  }
  const on = state.on ?? shader.on;
  if (on && on !== "patch") {
    words.push("--on", on);
  }
  for (const [name, value] of params) {
    words.push("-p", `${name}=${value}`);
  }
  words.push("-o", `${shader.file.replace(/^.*\//, "").replace(/\.\w+$/, "")}${ending}`);
  return words.map(word).join(" ");
}

/** The command line that makes the picture of a state. */
export function commandLine(shader, state) {
  return line(shader, state, state.params ?? shader.given, ".png");
}

/** The pictures of a contact sheet. */
const SHEET = 5;

/** The command line that makes a sheet of pictures, in which a parameter goes through the range of its slider. */
export function sheetLine(shader, state, { name, from, to, isInt }) {
  const others = (state.params ?? shader.given).filter(([known]) => known !== name);
  const count = isInt ? Math.min(SHEET, to - from + 1) : SHEET;
  return line(shader, state, [...others, [name, `${from}:${to}:${count}`]], ".sheet.png");
}
