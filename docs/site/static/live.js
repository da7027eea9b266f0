// Puts the explorer over the still pictures that it can draw: explorer/live.json has the state of each. The still picture
// stands until the live one is drawn, so also where a browser has no scripts or no WebAssembly, or where the site was
// built without the kernels.
const explorer = new URL("explorer/", document.currentScript.src);

async function enliven() {
  const answer = await fetch(new URL("live.json", explorer)).catch(() => null);
  if (!answer?.ok) return;
  for (const [name, {height, state}] of Object.entries(await answer.json())) {
    for (const still of document.querySelectorAll(`article img[src$="/${name}.svg"]`)) {
      const frame = document.createElement("iframe"), open = document.createElement("a");
      const address = `#pixels=${encodeURIComponent(JSON.stringify(state))}`;
      Object.assign(frame, {src: new URL(`index.html?figure${address}`, explorer).href, title: still.alt, className: "live", height: 0});
      Object.assign(open, {href: new URL(`index.html${address}`, explorer).href, textContent: "Open it in the explorer", className: "live"});
      addEventListener("message", ({source, data}) => {
        if (source !== frame.contentWindow || data !== "topleft is drawn") return;
        frame.height = height;
        still.hidden = true;
        frame.after(open);
      });
      still.after(frame);
    }
  }
}
document.addEventListener("DOMContentLoaded", enliven);
