// The worker of a page without Python: fetches the kernels and what Python has written down, then answers.

import {Kernels} from "./kernels.js";
import {Answerer} from "./local.js";

const fetched = async (name, take) => {
  const answer = await fetch(new URL(name, import.meta.url));
  if (!answer.ok) throw new Error(`${name} is not there (${answer.status}): serve the folder as it was written`);
  return take(answer);
};

const load = (name) => fetched(name, (answer) => answer.arrayBuffer());

const ready = (async () => {
  const [module, data] = await Promise.all([
    load("topleft.wasm").then((bytes) => WebAssembly.compile(bytes)),
    fetched("data.json", (answer) => answer.json()),
  ]);
  return new Answerer(await Kernels.of(module), data, load);
})();

onmessage = async ({data: question}) => {
  try {
    const [header, own] = await (await ready).answer(question);
    postMessage([header, own], [...new Set(own.map((part) => part.buffer))]);
  } catch (error) {
    postMessage([{id: question.id, error: error.message}, []]);
  }
};
