// Makes elements. Text from shaders only ever becomes text, never markup.

/** An element with attributes, properties (those that begin with a dot) and children: elements or text. */
export function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith(".")) {
      made[key.slice(1)] = value;
    } else if (value !== undefined && value !== null) {
      made.setAttribute(key, value);
    }
  }
  made.append(...children);
  return made;
}

/** Fills a menu with values, each with a text, and chooses one. */
export function fillMenu(menu, entries, chosen) {
  menu.replaceChildren(...entries.map(([value, text]) => element("option", { value }, text)));
  menu.value = chosen;
}
