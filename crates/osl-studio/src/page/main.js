// Joins the parts of the page: the connection, the panes, and the state that they show.

import { Connection } from "./socket.js";
import { SourcePane, messageText, severityClass } from "./source.js";
import { PicturePane } from "./picture.js";
import { ParameterPane } from "./parameters.js";
import { lineTexts, showExplanation } from "./explanation.js";
import {
  DIFFERENCE, commandLine, flushFragment, isSampled, readFragment, sheetLine, writeFragmentSoon,
} from "./state.js";
import { TapPane, isTap, movedLine, movedTap } from "./taps.js";
import { Wipe } from "./wipe.js";
import { Zoom } from "./zoom.js";
import { History } from "./history.js";
import { Editor } from "./editor.js";
import { Marks } from "./marks.js";
import { element, fillMenu } from "./element.js";

const at = (id) => document.getElementById(id);

/** The errors that the menu offers. */
const ERRORS = ["10%", "5%", "2%", "1%", "0.5%"];
/** The layer that shows where the samples of a picture with an error are. */
const SAMPLES = "samples";
/** The layer that shows the work of each pixel. */
const COST = "cost";
/** The layer that shows the digits lost to rounding. */
const ROUNDING = "rounding";

let state = readFragment();
let shader = null;
/** What the place of an explanation says without one. */
const hint = at("explanation").firstElementChild;

const source = new SourcePane(at("source"), at("messages"), (line) => taps.point(line), revealLine, (fix) => editor.fix(fix));
const editor = new Editor({
  text: at("editor"),
  edit: at("edit"),
  save: at("save"),
  overwrite: at("overwrite"),
  discard: at("discard"),
  word: at("edit-word"),
  send: (edit) => connection.save(edit),
  live: (file, text) => connection.unsaved(file, text),
  marks: new Marks(at("editor"), at("editor-under"), at("editor-numbers")),
  toggled: (isOpen) => {
    at("editor-box").hidden = !isOpen;
    at("source").hidden = isOpen;
    at("file").disabled = isOpen;
  },
  top: () => source.topLine,
});
const taps = new TapPane(at("taps"), { ask: (line) => connection.line(line), choose: chooseTap });
const parameters = new ParameterPane(at("parameters"), {
  changed: (name) => {
    showSheet();
    history.add(state.params ?? [], parameters.params(), name);
    changeState({ params: parameters.params() });
  },
  ended: () => history.end(),
});
const history = new History({ undo: at("undo"), redo: at("redo"), restore: restoreParams });
const zoom = new Zoom({
  frame: at("frame"),
  canvas: at("picture"),
  pinned: at("pinned"),
  grid: at("grid"),
  buttons: { in: at("zoom-in"), out: at("zoom-out"), fit: at("zoom-fit") },
  changed: (view) => {
    state = { ...state, view };
    writeFragmentSoon(state);
  },
});
const picture = new PicturePane(at("picture"), at("cross"), zoom, (point) => connection.explain(point));
const wipe = new Wipe({
  canvas: at("picture"),
  pinned: at("pinned"),
  zoom,
  button: at("pin"),
  slider: at("wipe"),
  word: at("pin-word"),
  ask: (isPinned) => connection.pin(isPinned),
  changed: pinned,
});
zoom.read(state.view);
const connection = new Connection({ opened, lost, message: receive });

/** Changes a part of the state, and shows it. */
function changeState(part) {
  state = { ...state, ...part };
  show();
  writeFragmentSoon(state);
}

/** Gives the parameters the values from before a change, or from after it. */
function restoreParams(params) {
  parameters.show(shader, params);
  changeState({ params: parameters.params() });
}

/** Shows a line in the editor, if that is open. */
function revealLine(line) {
  if (editor.isOpen) {
    editor.goTo(line);
  }
  return editor.isOpen;
}

/** A contact sheet is for the parameter whose slider was moved last. */
function showSheet() {
  const { moved } = parameters;
  at("copy-sheet").disabled = !moved || Boolean(state.lit);
  at("copy-sheet").textContent = moved ? `Copy contact sheet of ${moved.name}` : "Copy contact sheet";
  at("copy-sheet").title = moved
    ? `Copy the command line that makes a sheet of pictures with ${moved.name} from ${moved.from} to ${moved.to}`
    : "Move a slider first: the sheet has pictures for values of its parameter";
}

/** The layer with the difference is for a pinned picture. */
function pinned(isPinned) {
  layerOption(DIFFERENCE).disabled = !isPinned;
  if (!isPinned && state.layer === DIFFERENCE) {
    changeState({ layer: undefined });
    showOptions();
  }
}

/** What a tap replaces. */
let before = {};

/** A tap becomes the output, with all its values visible; a second click gives the output from before back. */
function chooseTap(tap, range) {
  if (state.output === tap) {
    changeState({ output: before.output ?? usualOutput(shader.outputs), range: before.range });
  } else {
    before = isTap(state.output) ? before : { output: state.output, range: state.range };
    changeState({ ...(state.layer === ROUNDING ? { layer: undefined } : {}), output: tap, range: range ? "auto" : before.range });
  }
  showOutputs();
  showOptions();
}

/** The outputs of the shader, and the tap that is shown. */
function showOutputs() {
  const names = shader.outputs.map(({ name, type }) => [name, `${name} (${type})`]);
  const tap = isTap(state.output) ? [[state.output, `${state.output} (tap)`]] : [];
  fillMenu(at("output"), [...names, ...tap], state.output);
  taps.chosen(state.output);
}

function show() {
  at("picture").setAttribute("aria-busy", "true");
  wipe.cover(state.layer !== DIFFERENCE);
  // The part that is seen is the business of the page alone.
  const { view, ...shown } = state;
  connection.show(shown);
}

function opened() {
  at("gone").hidden = true;
  if (editor.isChanged) {
    editor.again();
  }
  show();
}

function lost() {
  at("gone").textContent = "The server does not answer: oslrun studio has ended, or there are too many pages. Trying again every second…";
  at("gone").hidden = false;
  editor.lost();
}

function receive(message, samples) {
  answer(message, samples);
  if (!connection.isBusy) {
    flushFragment();
  }
  at("picture").setAttribute("aria-busy", String(connection.isBusy));
}

function answer(message, samples) {
  switch (message.type) {
    case "shader":
      showShader(message);
      break;
    case "picture":
      showPicture(message, samples);
      break;
    case "failed":
      showMessages(message.messages);
      at("status").textContent = picture.isEmpty ? "errors" : "errors; the last picture stays";
      break;
    case "pinned":
      if (message.pinned) {
        wipe.keep();
      }
      break;
    case "group":
      if (message.text) {
        copy(message.text, "The text of the group:");
      } else {
        showMessages(message.messages);
      }
      break;
    case "saved":
      editor.answer(message);
      break;
    case "line":
      taps.answer(message);
      break;
    case "explanation":
      // The answer may be about a picture that is gone.
      if (!picture.at) {
        break;
      }
      showExplanation(at("explanation"), message);
      source.values(message.explanation && shader ? lineTexts(message.explanation, shader.path) : []);
      document.dispatchEvent(new CustomEvent("studio-explanation", { detail: message }));
      break;
  }
}

function showShader(found) {
  const text = shader?.file === found.file ? shader.text : null;
  shader = found;
  const isBroken = shader.layers.length === 0;
  document.title = `${shader.file} – oslrun studio`;
  at("title").textContent = shader.path;
  source.show(shader);
  editor.show(shader);
  showFile(text);
  at("images").replaceChildren(...shader.images.map((name) => element("option", { value: name })));
  fillMenu(at("file"), [...new Set([shader.file, ...shader.files])].map((name) => [name, name]), shader.file);
  showOptions();
  fillMenu(at("on"), shader.surfaces.map((name) => [name, name]), state.on ?? shader.on ?? "patch");
  if (isBroken) {
    if (text === null) {
      showNothing();
    }
    return;
  }
  showControls(true);
  parameters.show(shader, state.params ?? shader.given);
  const names = shader.outputs.map((output) => output.name);
  let wanted = state.output ?? shader.output;
  if (isTap(wanted) && text !== null) {
    wanted = movedTap(wanted, text, shader.text);
  }
  const output = names.includes(wanted) || isTap(wanted) ? wanted : usualOutput(shader.outputs);
  const params = parameters.params();
  // What the page shows and what the server was told may differ now: an output or a parameter is gone, or the
  // page was opened without a state.
  if (output !== state.output || JSON.stringify(params) !== JSON.stringify(state.params ?? null)) {
    const isChosen = state.output !== undefined;
    changeState({ output, params, ...(!isChosen && isLit(output) ? withLight(true) : {}) });
    showOptions();
    at("on").value = state.on ?? shader.on ?? "patch";
  }
  showOutputs();
}

/** Another file, which has errors: nothing of the file before it stays. */
function showNothing() {
  picture.clear();
  parameters.show(shader, []);
  fillMenu(at("output"), []);
  showControls(false);
  showSheet();
  source.values([]);
  at("printed").hidden = true;
  at("explanation").replaceChildren(hint);
}

/** Whether there are outputs and parameters to choose. */
function showControls(hasSome) {
  for (const name of ["output", "random", "reset"]) {
    at(name).disabled = !hasSome;
  }
}

/** How the picture is shown; one with light has no range and no layer. */
function showOptions() {
  at("lit").checked = Boolean(state.lit);
  const ranges = [["", "usual"], ["auto", "auto"]];
  const own = state.range && state.range !== "auto" ? [[state.range, state.range]] : [];
  fillMenu(at("range"), [...ranges, ...own], state.range ?? "");
  at("range").disabled = Boolean(state.lit);
  const isFlat = !state.lit && (state.on ?? shader?.on ?? "patch") === "patch";
  const errors = [["", isSampled(shader) ? "as started" : "off"], ...ERRORS.map((error) => [error, error.replace("%", " %")])];
  const other = state.max_error && !ERRORS.includes(state.max_error) ? [[state.max_error, state.max_error]] : [];
  fillMenu(at("max-error"), [...errors, ...other], state.max_error ?? "");
  at("max-error").disabled = Boolean(state.lit);
  showSheet();
  layerOption(ROUNDING).disabled = !isFlat || isTap(state.output);
  layerOption(COST).disabled = !isFlat || Boolean(state.max_error) || isSampled(shader);
  layerOption(SAMPLES).disabled = Boolean(state.lit) || !(state.max_error || isSampled(shader, true));
  at("layer").value = state.layer ?? "";
  at("layer").disabled = Boolean(state.lit);
}

function layerOption(name) {
  return at("layer").querySelector(`[value=${name}]`);
}

/** The line that is shown stays the same one after a change of the file; another file has none. */
function showFile(text) {
  if (text === null) {
    source.release();
    taps.close();
    history.clear();
  } else if (taps.line) {
    taps.line = movedLine(taps.line, text, shader.text);
  }
}

/** The light that a surface reflects, else the first color, or the first output. */
function usualOutput(outputs) {
  const usual = outputs.find((output) => output.name === "Ci") ?? outputs.find((output) => output.type === "color");
  return (usual ?? outputs[0])?.name;
}

/** Whether an output is shown with light. */
function isLit(name) {
  return Boolean(shader?.outputs.some((output) => output.name === name && output.type === "closure color"));
}

/** The parts of a state for a picture with light, or without. */
function withLight(lit) {
  // The patch has no preview; the surface of a preview is a sphere, unless another one is chosen.
  const isPatch = (state.on ?? shader?.on ?? "patch") === "patch";
  return { lit, ...(lit ? { on: isPatch ? "sphere" : state.on, max_error: undefined, layer: undefined } : {}) };
}

function showPicture(message, samples) {
  picture.show(message, samples, shader ? shader.size : [message.width, message.height]);
  if (message.coarse) {
    at("status").textContent = "coarse…";
    document.dispatchEvent(new CustomEvent("studio-coarse", { detail: message }));
    return;
  }
  const milliseconds = (seconds) => `${(seconds * 1000).toFixed(0)} ms`;
  at("status").textContent = milliseconds(message.seconds);
  at("status").title = Object.entries(message.phases).map(([name, time]) => `${name} ${milliseconds(time)}`).join(", ");
  showMessages(message.messages);
  at("printed").textContent = message.text;
  at("printed").hidden = message.text === "";
  if (picture.at) {
    connection.explain(picture.at);
  }
  taps.again();
  document.dispatchEvent(new CustomEvent("studio-picture", { detail: message }));
}

/** Shows the messages of a run: at their lines, and those without a line below the picture. */
function showMessages(messages) {
  source.annotate(messages, "run");
  at("run-messages").replaceChildren(...messages.map((message) => {
    const place = message.file ? `${message.file}:${message.line}: ` : "";
    return element("li", { class: severityClass(message) }, place + messageText(message));
  }));
}

at("file").onchange = () => changeState({ file: at("file").value, output: undefined, params: [] });
at("output").onchange = () => {
  const output = at("output").value;
  changeState({ output, ...(isLit(output) ? withLight(true) : {}) });
  at("on").value = state.on ?? shader.on ?? "patch";
  showOutputs();
  showOptions();
};
/** The parts of a state that need an error. */
function withoutSamples() {
  return { max_error: undefined, layer: state.layer === SAMPLES ? undefined : state.layer };
}

/** The layers that a surface does not have. */
function withoutPatch() {
  return { layer: [COST, ROUNDING].includes(state.layer) ? undefined : state.layer };
}

at("on").onchange = () => {
  changeState({ on: at("on").value, ...withoutPatch() });
  showOptions();
};
at("lit").onchange = () => {
  changeState({ max_error: undefined, layer: undefined, ...withLight(at("lit").checked) });
  at("on").value = state.on ?? shader?.on ?? "patch";
  showOptions();
};
at("range").onchange = () => changeState({ range: at("range").value || undefined });
at("max-error").onchange = () => {
  const error = at("max-error").value || undefined;
  changeState(error ? { max_error: error, layer: state.layer === COST ? undefined : state.layer } : withoutSamples());
  showOptions();
};
at("layer").onchange = () => changeState({ layer: at("layer").value || undefined });
addEventListener("keydown", (event) => {
  if (event.key === "Escape") {
    source.release();
    taps.close();
  }
});
at("reset").onclick = () => parameters.reset();
at("random").onclick = () => parameters.random();
/** Puts a text on the clipboard. */
async function copy(text, name) {
  try {
    await navigator.clipboard.writeText(text);
    at("status").textContent = "copied";
  } catch {
    // Without the permission to copy, the text is shown.
    prompt(name, text);
  }
}

at("copy").onclick = () => shader && copy(commandLine(shader, state), "The command line:");
at("copy-group").onclick = () => connection.group();
at("copy-sheet").onclick = () => copy(sheetLine(shader, state, parameters.moved), "The command line:");
addEventListener("hashchange", () => {
  state = readFragment();
  writeFragmentSoon(state);
  zoom.read(state.view);
  if (shader) {
    history.clear();
    parameters.show(shader, state.params ?? shader.given);
    showOutputs();
    showOptions();
  }
  show();
});
