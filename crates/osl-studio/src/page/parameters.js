// The controls of the parameters, made from their types, defaults and metadata as `oslrun info` describes them.
// The value of a control is the text after `-p NAME=`, so that the page and a command line say the same.

import { element, fillMenu } from "./element.js";

const TRIPLES = new Set(["color", "point", "vector", "normal"]);
const CHECK_BOXES = new Set(["checkbox", "boolean", "bool"]);
/** Widgets of strings that name a file. */
const FILES = new Set(["filename", "fileinput", "file", "assetidinput", "texture"]);

/** A number as text, without the noise of binary fractions. */
function numberText(value) {
  return String(Number(Number(value).toPrecision(7)));
}

/** The text of a default value from a description. */
function defaultText(value) {
  if (Array.isArray(value)) {
    return value.flat().map((part) => (typeof part === "number" ? numberText(part) : String(part))).join(",");
  }
  return value === null || value === undefined ? "" : typeof value === "number" ? numberText(value) : String(value);
}

/** The metadata as an object. */
function metadataOf(parameter) {
  return Object.fromEntries(parameter.metadata.map((datum) => [datum.name, datum.value]));
}

/** The range of a slider: from the metadata, else around the default. */
function rangeOf(metadata, usual, isInt) {
  const first = (...names) => names.map((name) => metadata[name]).find((value) => typeof value === "number");
  const low = first("softmin", "slidermin", "UImin", "min");
  const high = first("softmax", "slidermax", "UImax", "max");
  const reach = Math.max(isInt ? 10 : 1, Math.abs(usual) * 2);
  const from = low ?? (usual < 0 ? -reach : 0);
  const to = high ?? Math.max(reach, from + reach);
  return { from, to: to > from ? to : from + 1, step: isInt ? 1 : first("sensitivity") ?? (to - from) / 1000 };
}

const toLinear = (x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);
const toDisplay = (x) => (x <= 0.0031308 ? x * 12.92 : 1.055 * x ** (1 / 2.4) - 0.055);

/** A linear color as `#rrggbb`, and back. */
function hexOf(parts) {
  const byte = (x) => Math.round(Math.min(1, Math.max(0, toDisplay(Math.max(0, x)))) * 255);
  return `#${parts.map((part) => byte(Number(part) || 0).toString(16).padStart(2, "0")).join("")}`;
}

function partsOf(hex) {
  return [1, 3, 5].map((at) => numberText(toLinear(parseInt(hex.slice(at, at + 2), 16) / 255).toPrecision(4)));
}

/** The choices of a menu: `a|b|c`, or `name:value|…`. */
function choicesOf(options) {
  return String(options).split("|").map((text) => {
    const at = text.lastIndexOf(":");
    return at < 0 ? [text, text] : [text.slice(at + 1), text.slice(0, at)];
  });
}

// Each control has its elements, and `set(text)`; it calls `changed(text)`.

function slider(parameter, metadata, usual, changed) {
  const isInt = parameter.type === "int";
  const { from, to, step } = rangeOf(metadata, Number(usual) || 0, isInt);
  const range = element("input", { type: "range", min: from, max: to, step, "aria-label": parameter.name });
  const field = element("input", { type: "number", step: isInt ? 1 : "any", min: metadata.min, max: metadata.max,
    "aria-label": `${parameter.name}, as a number` });
  range.oninput = () => changed((field.value = numberText(range.value)));
  field.oninput = () => {
    if (field.value !== "" && field.checkValidity()) {
      range.value = field.value;
      changed(field.value);
    }
  };
  const reach = { from: numberText(from), to: numberText(to), isInt };
  const random = () => numberText(from + Math.floor(Math.random() * (Math.floor((to - from) / step) + 1)) * step);
  return { parts: [range, field], reach, random, set: (text) => { range.value = text; field.value = text; } };
}

function triple(parameter, changed) {
  const fields = ["x", "y", "z"].map((name) => element("input", { type: "number", step: "any", "aria-label": `${parameter.name} ${name}` }));
  const tell = () => fields.every((field) => field.value !== "") && changed(fields.map((field) => field.value).join(","));
  let picker = null;
  if (parameter.type === "color") {
    picker = element("input", { type: "color", "aria-label": `${parameter.name}, color` });
    picker.oninput = () => {
      partsOf(picker.value).forEach((part, at) => { fields[at].value = part; });
      tell();
    };
  }
  fields.forEach((field) => {
    field.oninput = () => {
      tell();
      if (picker) {
        picker.value = hexOf(fields.map((one) => one.value));
      }
    };
  });
  const set = (text) => {
    const parts = text.split(",");
    fields.forEach((field, at) => { field.value = parts[at] ?? parts[0]; });
    if (picker) {
      picker.value = hexOf(fields.map((field) => field.value));
    }
  };
  const random = picker ? () => fields.map(() => numberText(Math.random().toPrecision(3))).join(",") : undefined;
  return { parts: picker ? [picker, ...fields] : fields, random, set };
}

function checkBox(parameter, changed) {
  const box = element("input", { type: "checkbox", "aria-label": parameter.name });
  box.onchange = () => changed(box.checked ? "1" : "0");
  return { parts: [box], random: () => String(Math.round(Math.random())), set: (text) => { box.checked = Number(text) !== 0; } };
}

function menu(parameter, choices, changed) {
  const select = element("select", { "aria-label": parameter.name });
  fillMenu(select, choices, choices[0][0]);
  select.onchange = () => changed(select.value);
  const set = (text) => {
    if (!choices.some(([value]) => value === text)) {
      fillMenu(select, [...choices, [text, text]], text);
    }
    select.value = text;
  };
  const random = () => choices[Math.floor(Math.random() * choices.length)][0];
  return { parts: [select], random, set };
}

function textField(parameter, changed, isFile) {
  // A name of a file can be chosen from those that are there.
  const field = element("input", { type: "text", spellcheck: "false", "aria-label": parameter.name, list: isFile ? "images" : null });
  field.onchange = () => changed(field.value);
  return { parts: [field], set: (text) => { field.value = text; } };
}

function controlOf(parameter, metadata, usual, changed) {
  const widget = String(metadata.widget ?? "").toLowerCase();
  if (parameter.type === "int" && CHECK_BOXES.has(widget)) {
    return checkBox(parameter, changed);
  }
  if (metadata.options !== undefined && (parameter.type === "int" || parameter.type === "string")) {
    const choices = choicesOf(metadata.options);
    const isNamed = parameter.type === "string" || choices.some(([value, text]) => value !== text);
    return menu(parameter, isNamed ? choices : choices.map(([text], at) => [String(at), text]), changed);
  }
  if (parameter.type === "float" || parameter.type === "int") {
    return slider(parameter, metadata, usual, changed);
  }
  return TRIPLES.has(parameter.type) ? triple(parameter, changed) : textField(parameter, changed, FILES.has(widget));
}

/** The pane with the parameters. */
export class ParameterPane {
  /** `changed(name)` is called when a value is changed by hand; without a name, several are. `ended()` is called
   * when the change is complete: a slider was let go. */
  constructor(form, { changed, ended }) {
    Object.assign(this, { form, changed });
    form.addEventListener("change", ended);
    /** The name and the range of the slider that was moved last. */
    this.moved = null;
    this.values = new Map();
    this.controls = new Map();
    form.onsubmit = (event) => event.preventDefault();
  }

  /** The values that differ from the defaults of the shader, as pairs of name and text. */
  params() {
    return [...this.values];
  }

  /** Makes the controls of a shader again, with these values; those of unknown parameters are dropped. */
  show(shader, params) {
    const known = JSON.stringify(shader.layers);
    const focused = document.activeElement?.getAttribute("aria-label");
    const values = new Map(params);
    if (known !== this.known) {
      this.known = known;
      this.moved = null;
      this.controls.clear();
      this.form.replaceChildren(...this.groups(shader));
      const again = focused && this.form.querySelector(`[aria-label="${CSS.escape(focused)}"]`);
      again?.focus();
    }
    this.values = new Map([...values].filter(([name]) => this.controls.has(name)));
    this.controls.forEach((control, name) => this.update(control, name));
  }

  /** The controls under the headings of their layers and pages. */
  groups(shader) {
    const pages = new Map();
    for (const layer of [...shader.layers].reverse()) {
      for (const parameter of layer.description.parameters) {
        const metadata = metadataOf(parameter);
        const isHidden = metadata.hidden === 1 || metadata.widget === "null";
        if (parameter.output || isHidden || parameter.type.includes("closure") || parameter.type.startsWith("struct")) {
          continue;
        }
        const heading = [layer.name, metadata.page].filter(Boolean).join(": ");
        const page = pages.get(heading) ?? [];
        pages.set(heading, page);
        page.push(this.row(layer, parameter, metadata));
      }
    }
    const heading = (text) => (text ? [element("legend", {}, text)] : []);
    const made = [...pages].map(([text, rows]) => element("fieldset", {}, ...heading(text), ...rows));
    const none = shader.layers.length ? "The shader has no parameters." : "The file has errors.";
    return made.length ? made : [element("p", { class: "dim" }, none)];
  }

  row(layer, parameter, metadata) {
    const name = layer.name ? `${layer.name}.${parameter.name}` : parameter.name;
    const usual = defaultText(parameter.default);
    const changed = (text) => {
      text === usual ? this.values.delete(name) : this.values.set(name, text);
      row.classList.toggle("changed", this.values.has(name));
      this.moved = control.reach ? { name, ...control.reach } : this.moved;
      this.changed(name);
    };
    const control = controlOf({ ...parameter, name }, metadata, usual, changed);
    const undo = element("button", { type: "button", class: "undo", title: `Reset ${name} to ${usual}` }, "↺");
    const kind = control.parts.length > 2 ? "row triple" : "row";
    const help = typeof metadata.help === "string" ? metadata.help : "";
    const row = element("div", { class: "parameter", "data-name": name, title: help || `${parameter.type} ${name}` },
      element("label", {}, String(metadata.label ?? name)),
      element("div", { class: kind }, ...control.parts, undo));
    undo.onclick = () => {
      this.values.delete(name);
      this.update(this.controls.get(name), name);
      this.changed();
    };
    this.controls.set(name, { ...control, row, usual });
    return row;
  }

  update({ set, row, usual }, name) {
    set(this.values.get(name) ?? usual);
    row.classList.toggle("changed", this.values.has(name));
  }

  /** Gives parameters random values: those whose control knows which values make sense. */
  random() {
    this.controls.forEach((control, name) => {
      if (control.random) {
        const text = control.random();
        text === control.usual ? this.values.delete(name) : this.values.set(name, text);
        this.update(control, name);
      }
    });
    this.changed();
  }

  /** Gives all parameters their defaults. */
  reset() {
    this.values.clear();
    this.controls.forEach((control, name) => this.update(control, name));
    this.changed();
  }
}
