// Answers the page in the place of Python: the questions of handlers.py that need no more than the kernels.
// In: a question {do, id, ...}. Out: a promise of [header, parts], as messages.py splits an answer.

import {drawAll} from "./pixels.js";
import {probe} from "./probe.js";
import * as race from "./race.js";
import {trace} from "./steps.js";

const NAMES = new Map([[Uint8ClampedArray, "uint8"], [Uint8Array, "uint8"], [Int32Array, "int32"], [Float32Array, "float32"]]);

const HANDLERS = {
  hello: (kernels, data) => ({header: data.hello}),
  "pixels.draw": drawAll,
  "pixels.probe": probe,
  "pixels.scene": (kernels, data, {name}) => {
    if (!(name in data.states)) throw new Error(`scene must be one of ${data.hello.scenes.join(", ")}, got '${name}'`);
    return {header: {state: data.states[name]}};
  },
  "steps.trace": trace,
  "race.families": race.families,
  "race.draw": race.draw,
  "race.column": race.column,
};

export class Answerer {
  // `load(name)` promises the bytes of a file of the folder.
  constructor(kernels, data, load) {
    Object.assign(this, {kernels, data, load});
  }

  async answer(question) {
    const {id} = question;
    try {
      if (`${question.do}`.startsWith("race.")) this.data.race.bytes ??= await this.load("race.bin");
      if (!(question.do in HANDLERS)) throw new Error(`nothing is called '${question.do}' here`);
      const {header, arrays = {}} = HANDLERS[question.do](this.kernels, this.data, question);
      const listed = Object.entries(arrays).map(([name, [array, shape]], part) => [name, {dtype: NAMES.get(array.constructor), shape, part}]);
      return [{...header, id, arrays: Object.fromEntries(listed)}, Object.values(arrays).map(([array]) => new Uint8Array(array.buffer))];
    } catch (error) {
      const isFull = error instanceof RangeError && /memory|length|allocation/i.test(error.message);
      const sentence = isFull ? "not enough memory" : error.message.split(/\s+/).join(" ").slice(0, 400);
      return [{id, error: sentence}, []];
    }
  }
}
