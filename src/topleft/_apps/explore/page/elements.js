// Elements of the page that its parts share, files to download, pictures on a canvas.

// An element: make("button.main", {onclick}, "text", child, ...).
export function make(what, properties = {}, ...children) {
  const [name, ...classes] = what.split(".");
  const element = document.createElement(name);
  element.className = classes.join(" ");
  for (const [key, value] of Object.entries(properties)) {
    if (key in element) element[key] = value;
    else element.setAttribute(key, value);
  }
  element.append(...children.flat());
  return element;
}

// The same for SVG, whose properties are attributes.
export function svg(name, attributes = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

export const group = (title, ...children) => make("section.group", {}, make("h2", {}, title), ...children);
export const row = (label, control) => make("label.row", {}, make("span", {}, label), control);
export const button = (text, onclick, title = "") => make("button", {type: "button", title, onclick}, text);

// A row with a choice of [value, text], or of words.
export function choose(label, options, value, write) {
  const box = make("select", {onchange: () => write(box.value)}, options.map(([own, text = own]) => make("option", {value: own}, `${text}`)));
  box.value = value;
  return row(label, box);
}

// The scenes that Python lists, in their groups, with what they show.
export const sceneOptions = (app) => app.hello.groups.map(([label, rows]) =>
  make("optgroup", {label}, ...rows.map(([name, title]) => make("option", {value: name, title}, name))));

// A key of colours: [text, [r, g, b]] each.
export const keyOf = (rows) => rows.map(([text, rgb]) => make("span", {}, make("i", {style: `background:rgb(${rgb})`}), text));

export function download(name, content, type = "") {
  const href = URL.createObjectURL(new Blob([content], {type}));
  make("a", {href, download: name}).click();
  setTimeout(() => URL.revokeObjectURL(href), 10000);
}

// A picture (H, W, 4) uint8 of Python's as it is, a canvas pixel for each of its pixels.
export function paint(canvas, pixels) {
  const [height, width] = pixels.shape;
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, {width, height});
  canvas.getContext("2d").putImageData(new ImageData(pixels, width, height), 0, 0);
}
