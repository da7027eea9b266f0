// Asks the page that `topleft explore --export` has written, without a browser: node ask_static.mjs FOLDER SET, with a
// list of questions as JSON on standard input; one with "is_full" is asked while no memory is left.
// Out: a list of answers, arrays as base64.
import {readFile} from "node:fs/promises";
import {pathToFileURL} from "node:url";

const [folder, set] = process.argv.slice(2), at = (name) => new URL(name, pathToFileURL(`${folder}/`));
const {Kernels} = await import(at("kernels.js")), {Answerer} = await import(at("local.js"));
const chunks = [];
for await (const chunk of process.stdin) chunks.push(chunk);
const kernels = await Kernels.of(await readFile(at(`topleft-${set}.wasm`)));
const load = async (name) => (({buffer, byteOffset, length}) => buffer.slice(byteOffset, byteOffset + length))(await readFile(at(name)));
const answerer = new Answerer(kernels, JSON.parse(await readFile(at("data.json"), "utf8")), load);
const replies = [], {exports} = kernels;

for (const {is_full: isFull, ...question} of JSON.parse(Buffer.concat(chunks))) {
  const before = exports.web_used();
  for (let n = 2 ** 28; isFull && n >= 64; n /= 2) while (exports.web_room(n));
  const [header, parts] = await answerer.answer({id: 1, ...question});
  if (isFull) exports.web_release(before);
  replies.push({...header, bytes: parts.map((part) => Buffer.from(part).toString("base64")), memory: exports.memory.buffer.byteLength});
}
process.stdout.write(JSON.stringify(replies));
