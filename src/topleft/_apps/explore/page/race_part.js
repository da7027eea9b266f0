// The part Race: families of scenes, and where each method is wrong.

import {make, group, row, button, choose, keyOf, paint} from "./elements.js";
import {newest} from "./line.js";
import {FAULTS, race, raceColumn} from "./race.js";

export function racePart(app, panel) {
  const view = {family: "fan", positions: [3], seed: 0}, part = {state: () => view, enter, restore, drawn: 0};
  const stage = make("div.stage.race"), sliders = make("div"), what = make("p"), chart = make("table.chart"), by = make("p.hint"), side = make("div.side");
  const {race: known} = app.hello;
  let racers = [], mapped = "";

  const draw = newest(async () => {
    const told = await race(app.line, app.hello, view).catch((error) => void app.say(error.message, true));
    if (!told) return;
    racers.forEach(({canvas, count, figure}, k) => {
      const {text, title, bad} = told.rows[k];
      paint(canvas, told.pictures[k]);
      Object.assign(count, {textContent: text, className: bad === 0 ? "good" : "bad"});
      figure.title = title;
    });
    sliders.querySelectorAll("output").forEach((output, i) => (output.textContent = told.values[i]));
    const here = Math.round(view.positions.at(-1)) + 1;
    for (const line of chart.rows) [...line.cells].forEach((cell, i) => cell.classList.toggle("here", i === here));
    part.drawn++;
    app.say("");
  });
  // The chart is filled column by column; another family, seed or first parameter begins another.
  async function map() {
    const {axes} = known.families[view.family], axis = axes.at(-1), others = view.positions.slice(0, -1);
    const wanted = JSON.stringify([view.family, view.seed, others]);
    if (mapped === wanted) return;
    mapped = wanted;
    by.textContent = `Wrong pixels, in % of those that an edge meets, by ${axis.what}. A dot: with gaps.`;
    const head = axis.steps.map((step, i) => make("th", {scope: "col"}, button(step, () => set(axes.length - 1, i))));
    chart.replaceChildren(make("thead", {}, make("tr", {}, make("th"), ...head)), make("tbody", {}, ...known.entries.map(({name}) =>
      make("tr", {}, make("th", {scope: "row"}, name), ...head.map(() => make("td"))))));
    for (let i = 0; i < axis.steps.length; i++) {
      const column = await raceColumn(app.line, app.hello, {...view, positions: [...others, i]}).catch(() => null);
      if (mapped !== wanted || !column) return;
      column.cells.forEach(({text, color, kind, title}, k) => {
        const cell = Object.assign(chart.tBodies[0].rows[k].cells[i + 1], {textContent: text, title});
        cell.classList.add(...kind.split(" "));
        cell.style.background = color;
      });
    }
  }
  function redraw() {
    draw(), map(), app.keep();
  }
  function set(i, position) {
    view.positions[i] = position;
    sliders.querySelectorAll("input")[i].value = position;
    redraw();
  }
  function take(family) {
    const {axes, what: text} = known.families[family];
    if (family !== view.family || view.positions.length !== axes.length) view.positions = axes.map(() => 0);
    view.family = family;
    what.textContent = `${text[0].toUpperCase()}${text.slice(1)}. Each pixel has to be drawn once, and as the vertices say before any snap. auto snaps vertices to 2^-8 px first, so a pixel whose centre an edge passes that closely may be another triangle's; "auto, exact" snaps nothing and has no wrong pixel.`;
    sliders.replaceChildren(...axes.map(({what, steps, is_continuous}, i) => make("label.slider", {}, make("span", {}, `${what}: `, make("output")), make("input", {
      type: "range", min: 0, max: steps.length - 1, step: is_continuous ? 0.05 : 1, value: view.positions[i], oninput: ({target}) => set(i, target.valueAsNumber),
    }))));
    redraw();
  }
  function build() {
    const seed = make("input", {type: "number", min: 0, max: known.n_seeds - 1, value: view.seed, onchange: () => (view.seed = Math.min(seed.max, Math.max(0, seed.valueAsNumber | 0)), redraw())});
    const families = Object.keys(known.families).map((name) => [name]);
    side.replaceChildren(group("Race", choose("family", families, view.family, take), what, sliders, row("seed", seed), make("div.legend", {}, ...keyOf(FAULTS))));
    take(view.family);
  }
  function enter() {
    if (panel.firstChild) return;
    panel.append(make("div.layout.wide", {}, stage, side, group("Chart", by, make("div.scroll", {tabIndex: 0}, chart))));
    racers = known.entries.map(({name}) => {
      const canvas = make("canvas"), count = make("span");
      return {canvas, count, figure: make("figure", {}, canvas, make("figcaption", {}, name.replace(/[_/]/g, "$&\u200b"), count))};
    });
    stage.append(...racers.map(({figure}) => figure));
    build();
  }
  function restore(given) {
    Object.assign(view, given);
    if (racers.length) build();
  }
  return part;
}
