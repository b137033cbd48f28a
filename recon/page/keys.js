// What the keys do, and the table that says so.
"use strict";

function listen(root, app) {
  const toggle = (name) => () => app.show(name, !app.shown[name]);
  const family = !!app.family;
  const keys = [
    [["ArrowRight"], "→", family && "next critical value", () => app.step(1)],
    [["ArrowLeft"], "←", family && "critical value before", () => app.step(-1)],
    [["PageUp", "Shift+ArrowRight"], "Shift →", family && "far up", () => app.slide(0.02)],
    [["PageDown", "Shift+ArrowLeft"], "Shift ←", family && "far down", () => app.slide(-0.02)],
    [["Home"], "Home", family && "before the first critical value", () => app.setAlpha(app.scale.alpha(0))],
    [["End"], "End", family && "after the last", () => app.setAlpha(app.scale.alpha(1))],
    [["0"], "0", family && "α = 0", () => app.setAlpha(0)],
    [["g"], "G", family && meta.marks.length > 0 && "recommended α", () => app.setAlpha(meta.marks[0].alpha)],
    [[" "], "Space", family && "sweep, stop", () => app.play()],
    [["1"], "1", family && "singular facets", toggle("singular")],
    [["2"], "2", family && "regular facets", toggle("regular")],
    [["3"], "3", family && "interior", toggle("interior")],
    [["m"], "M", !!app.arrays.faces && "mesh", toggle("mesh")],
    [["p"], "P", "points", toggle("points")],
    [["["], "[", "smaller points", () => app.resize(-0.25)],
    [["]"], "]", "larger points", () => app.resize(0.25)],
    [["k"], "K", "colour by kind", () => app.setColour(-1)],
    [["w"], "W", "colour by weight", () => app.colourNamed("weight")],
    [["e"], "E", "colour by error: distance", () => app.colourNamed("error")],
    [["x"], "X", "cut across x", () => app.setCut(0)],
    [["y"], "Y", "cut across y", () => app.setCut(1)],
    [["z"], "Z", "cut across z", () => app.setCut(2)],
    [[","], ",", "move the cut back", () => app.moveCut(-0.02)],
    [["."], ".", "move the cut on", () => app.moveCut(0.02)],
    [["r"], "R", "other side of the cut", () => app.turnCut()],
    [["f"], "F", "whole view", () => app.world.home()],
    [["u"], "U", "next axis upright", () => app.world.turn()],
    [["t"], "T", "light or dark", () => app.toggleTheme()],
    [["?", "h"], "?", "this help", () => app.help()],
  ];
  const list = root.querySelector(".help ul");
  for (const [, cap, meaning] of keys.filter(([, , text]) => text)) {
    const row = document.createElement("li"), key = document.createElement("kbd");
    key.textContent = cap;
    row.append(key, meaning);
    list.append(row);
  }
  const actions = new Map(keys.flatMap(([names, , text, act]) => (text ? names.map((name) => [name, act]) : [])));
  const scope = root.classList.contains("embedded") ? root : document;
  scope.addEventListener("keydown", (event) => {
    const at = event.target;
    if (event.ctrlKey || event.metaKey || event.altKey || at.matches("input[type=text], select")) return;
    if (root.querySelector(".help").open && !["?", "h"].includes(event.key)) return;
    const isSpecial = event.key.length > 1 || event.key === " ";
    if (isSpecial && at.matches("input[type=range]:not(.slider)")) return; // they move their own knob
    if (event.key === " " && at.matches("button, summary, input:not(.slider)")) return;
    const name = event.key.length === 1 ? event.key.toLowerCase() : (event.shiftKey ? "Shift+" : "") + event.key;
    const act = actions.get(name);
    if (!act) return;
    event.preventDefault();
    act();
  });
}
