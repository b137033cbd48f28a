// The controls of the view, and the keys: the last of the scripts.
"use strict";

const root = document.querySelector(".viewer");
const find = (selector) => root.querySelector(selector);
const meta = JSON.parse(document.getElementById("recon-meta").textContent);
const CLASSES = ["singular", "regular", "interior"];
const HOLES = ["piece", meta.dimension === 2 ? "hole" : "tunnel", "void"]; // one of each, by dimension

const digits = (value) => (Number.isFinite(value) ? String(Number(value.toPrecision(4))) : value > 0 ? "∞" : "−∞");
const grouped = (count) => count.toLocaleString("en-US");

class App {
  constructor(arrays) {
    this.world = new World(find(".scene"), arrays, meta.spacing);
    this.arrays = arrays;
    this.family = arrays.critical ? new Family(arrays) : null;
    this.shown = { singular: true, regular: true, interior: false, mesh: !this.family, points: true };
    this.colour = -1;
    this.axis = -1;
    this.side = 1;
    this.makeLayers();
    this.makePanel();
    listen(root, this);
    if (this.family) this.makeSweep();
    else this.refresh();
    this.setTheme(document.documentElement.dataset.theme || (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"));
    if (innerWidth <= 640) find(".panel").open = false;
  }

  makeLayers() {
    const { world, arrays, family } = this;
    if (family) {
      const { width } = family, capacity = width * family.first.length;
      world.layers.facets = new Layer(world, width, capacity, CLASSES.map((name) => world.materialOf(width, name)));
      if (family.cells) {
        world.layers.cells = new Layer(world, width + 1, (width + 1) * family.entries.length, [world.materialOf(width + 1, "interior")]);
        this.shown.interior = true;
      }
    }
    if (arrays.faces) {
      world.layers.mesh = new Layer(world, 3, 3 * arrays.faces[0].length, [world.materialOf(3, "mesh")]);
      world.layers.mesh.indices.set(interleave(arrays.faces));
    }
    world.layers.points = new Layer(world, 1, meta.points, [world.disks("points", meta.spacing)]);
    for (let i = 0; i < meta.points; i++) world.layers.points.indices[i] = i;
  }

  makePanel() {
    find(".title").textContent = meta.title || "";
    find(".facts").textContent = meta.facts;
    this.boxes = {};
    const names = { singular: "singular facets", regular: "regular facets", interior: "interior facets", mesh: "mesh", points: "points" };
    if (this.family && this.family.cells) names.interior = "inside";
    const keys = { singular: "1", regular: "2", interior: "3", mesh: "M", points: "P" };
    const there = [...(this.family ? CLASSES : []), ...(this.arrays.faces ? ["mesh"] : []), "points"];
    for (const name of there) {
      const label = document.createElement("label"), box = document.createElement("input"), swatch = document.createElement("span"), count = document.createElement("output");
      box.type = "checkbox";
      box.checked = this.shown[name];
      box.addEventListener("change", () => this.show(name, box.checked));
      swatch.className = "swatch";
      swatch.style.background = `var(--${name})`;
      label.title = `Key ${keys[name]}`;
      label.append(box, swatch, names[name], count);
      find(".layers").append(label);
      this.boxes[name] = { box, count };
    }
    this.boxes.points.count.textContent = grouped(meta.points);
    if (this.arrays.faces) this.boxes.mesh.count.textContent = grouped(this.arrays.faces[0].length);

    const select = find(".colours select");
    select.append(new Option(this.family ? "kind" : "nothing", "-1"));
    meta.colours.forEach((colour, k) => select.append(new Option(colour.label, k)));
    select.addEventListener("change", () => this.setColour(Number(select.value)));
    for (const button of root.querySelectorAll("[data-axis]")) button.addEventListener("click", () => this.setCut(Number(button.dataset.axis)));
    find("[data-turn]").addEventListener("click", () => this.turnCut());
    find(".cut input").addEventListener("input", () => this.cut());
    find(".looks input").addEventListener("input", () => this.resize());
    find("[data-do=home]").addEventListener("click", () => this.world.home());
    find("[data-do=theme]").addEventListener("click", () => this.toggleTheme());
    find("[data-do=help]").addEventListener("click", () => this.help());
    this.resize();
  }

  makeSweep() {
    const { family } = this;
    find(".sweep").hidden = false;
    this.scale = new Scale(family);
    const slider = find(".slider"), field = find(".alpha"), chart = find(".chart");
    slider.addEventListener("input", () => this.setAlpha(this.scale.alpha(Number(slider.value)), false));
    field.addEventListener("change", () => this.typed(field));
    field.addEventListener("input", () => field.removeAttribute("aria-invalid"));
    const drag = (event) => {
      if (!event.buttons && event.type !== "pointerdown") return;
      if (event.type === "pointerdown") chart.setPointerCapture(event.pointerId);
      const box = chart.getBoundingClientRect();
      this.setAlpha(this.scale.alpha((event.clientX - box.left) / box.width));
    };
    chart.addEventListener("pointerdown", drag);
    chart.addEventListener("pointermove", drag);
    find("[data-do=play]").addEventListener("click", () => this.play());
    family.betti.forEach((_, k) => {
      const item = document.createElement("span"), value = document.createElement("b");
      value.style.color = `var(--b${k})`;
      item.append(value, " ", document.createElement("span"));
      item.title = `Betti number ${k}`;
      find(".betti").append(item);
    });
    const marks = find(".marks");
    marks.append("Go to");
    for (const [k, mark] of meta.marks.entries()) {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = mark.name;
      button.title = `α = ${digits(mark.alpha)}: ${mark.why}`;
      if (!k) button.className = "best";
      button.addEventListener("click", () => this.setAlpha(mark.alpha));
      marks.append(button);
    }
    new ResizeObserver(() => this.chart()).observe(chart);
    this.setAlpha(meta.alpha);
  }

  typed(field) {
    const text = field.value.trim().replace("−", "-").replace(/^([+-]?)(∞|inf|infinity)$/i, "$1Infinity");
    const alpha = Number(text);
    if (text === "" || Number.isNaN(alpha)) field.setAttribute("aria-invalid", "true");
    else this.setAlpha(alpha);
  }

  // The one way to change alpha.
  setAlpha(alpha, moveSlider = true) {
    this.alpha = alpha + 0;
    this.refresh();
    const place = this.scale.place(alpha);
    if (moveSlider) find(".slider").value = place;
    find(".slider").setAttribute("aria-valuetext", `alpha ${digits(alpha)}`);
    find(".cursor").style.left = `${100 * place}%`;
    const field = find(".alpha");
    field.value = String(alpha);
    field.removeAttribute("aria-invalid");
    find(".radius").textContent = meta.weighted ? "" : alpha >= 0 ? `radius √α = ${digits(Math.sqrt(alpha))}` : "no radius: α < 0";
    const r = this.family.rank(alpha);
    root.querySelectorAll(".betti > span").forEach((item, k) => {
      const count = r ? this.family.betti[k][r - 1] : 0;
      item.firstChild.textContent = grouped(count);
      item.lastChild.textContent = HOLES[k] + (count === 1 ? "" : "s");
    });
  }

  // Step to the critical value that lies so many further.
  step(count) {
    if (!this.family) return;
    const { critical } = this.family, r = this.family.rank(this.alpha);
    const onOne = r > 0 && critical[r - 1] === this.alpha;
    const to = count > 0 ? r - 1 + count : onOne ? r - 1 + count : r + count;
    this.setAlpha(to < 0 ? this.scale.alpha(0) : critical[Math.min(critical.length - 1, to)]);
  }

  slide(share) {
    if (this.family) this.setAlpha(this.scale.alpha(Math.min(1, Math.max(0, this.scale.place(this.alpha) + share))));
  }

  play() {
    const button = find("[data-do=play]");
    if (this.playing) {
      cancelAnimationFrame(this.playing);
      this.playing = 0;
      button.textContent = "▶";
      return;
    }
    button.textContent = "❚❚";
    let place = this.scale.place(this.alpha), before = performance.now();
    if (place >= 1) place = 0;
    const frame = (now) => {
      place += (now - before) / 14000;
      before = now;
      this.setAlpha(this.scale.alpha(Math.min(1, place)));
      if (place >= 1) this.play();
      else this.playing = requestAnimationFrame(frame);
    };
    this.playing = requestAnimationFrame(frame);
  }

  // Bring what is drawn in line with alpha and the boxes.
  refresh() {
    const { family, shown } = this, { layers } = this.world;
    let counts = [0, 0, 0];
    if (family) {
      const wanted = family.cells ? [shown.singular, shown.regular, false] : CLASSES.map((name) => shown[name]);
      const found = family.select(this.alpha, wanted, layers.facets.indices);
      counts = found.counts;
      layers.facets.drawn(found.starts, found.sizes, true);
      if (layers.cells) {
        const end = family.selectCells(this.alpha, layers.cells.indices);
        layers.cells.drawn([0], [shown.interior ? end : 0], true);
        counts[2] = end / family.cells.length;
      }
      CLASSES.forEach((name, k) => { this.boxes[name].count.textContent = grouped(counts[k]); });
    }
    if (layers.mesh) layers.mesh.drawn([0], [shown.mesh ? layers.mesh.indices.length : 0], false);
    layers.points.drawn([0], [shown.points ? meta.points : 0], false);
    this.notify(counts);
    this.world.ask();
  }

  notify(counts) {
    const box = find(".notice"), text = box.querySelector("span"), button = box.querySelector("button");
    const meshSeen = this.world.layers.mesh && this.shown.mesh;
    box.hidden = true;
    button.hidden = true;
    if (this.family && !meshSeen && counts[0] + counts[1] === 0) {
      const there = this.family.nearestExposed(this.alpha);
      box.hidden = false;
      text.textContent = there === null ? "This family has no facet at any alpha." : "No facet at this alpha.";
      if (there !== null) {
        button.hidden = false;
        button.textContent = `Go to the nearest: ${digits(there)}`;
        button.onclick = () => this.setAlpha(there);
      }
    } else if (meta.note && !this.noteSeen) {
      box.hidden = false;
      text.textContent = meta.note;
      button.hidden = false;
      button.textContent = "Close";
      button.onclick = () => { this.noteSeen = true; box.hidden = true; };
    }
  }

  show(name, on) {
    if (!(name in this.boxes)) return;
    this.shown[name] = on;
    this.boxes[name].box.checked = on;
    this.refresh();
  }

  setColour(k) {
    this.colour = k;
    find(".colours select").value = String(k);
    const colour = meta.colours[k], scale = find(".colours .scale");
    scale.hidden = !colour || !!colour.rgb;
    if (colour) {
      this.world.colours.array.set(paint(colour, this.arrays[colour.array]));
      this.world.colours.needsUpdate = true;
    }
    if (colour && !colour.rgb) {
      scale.querySelector(".low").textContent = digits(colour.low);
      scale.querySelector(".high").textContent = digits(colour.high);
      scale.querySelector(".unit").textContent = `[${colour.unit}]`;
      scale.title = colour.meaning;
      const canvas = scale.querySelector("canvas"), pen = canvas.getContext("2d"), ramp = rampOf(colour);
      for (let x = 0; x < canvas.width; x++) {
        pen.fillStyle = `rgb(${blend(ramp, x / (canvas.width - 1))})`;
        pen.fillRect(x, 0, 1, canvas.height);
      }
    }
    this.world.recolour(!!colour);
  }

  colourNamed(name) {
    const k = meta.colours.findIndex((colour) => colour.array === `colour ${name}`);
    if (k >= 0) this.setColour(this.colour === k ? -1 : k);
  }

  setCut(axis) {
    this.axis = this.axis === axis ? -1 : axis;
    for (const button of root.querySelectorAll("[data-axis]")) button.setAttribute("aria-pressed", String(Number(button.dataset.axis) === this.axis));
    find(".cut input").disabled = this.axis < 0;
    this.cut();
  }

  turnCut() {
    this.side = -this.side;
    if (this.axis < 0) this.setCut(0);
    else this.cut();
  }

  moveCut(step) {
    const place = find(".cut input");
    place.value = Math.min(1, Math.max(0, Number(place.value) + step));
    this.cut();
  }

  cut() {
    const { world, axis, side } = this;
    if (axis < 0) {
      world.renderer.clippingPlanes = [];
    } else {
      const normal = [0, 0, 0], share = Number(find(".cut input").value);
      normal[axis] = -side;
      const pad = 1e-4 * world.reach, low = world.low[axis] - pad, high = world.high[axis] + pad;
      world.plane.normal.set(...normal);
      world.plane.constant = side * (low + share * (high - low));
      world.renderer.clippingPlanes = [world.plane];
    }
    world.ask();
  }

  resize(step = 0) {
    const knob = find(".looks input");
    if (step) knob.value = Number(knob.value) + step;
    for (const material of this.world.dots) material.size = material.userData.size * 2 ** Number(knob.value);
    this.world.ask();
  }

  setTheme(theme) {
    document.documentElement.dataset.theme = theme;
    this.world.recolour(this.colour >= 0);
    this.chart();
  }

  chart() {
    if (this.scale) drawChart(find(".chart canvas"), this.family, this.scale, meta.marks);
  }

  toggleTheme() { this.setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"); }

  help() {
    const dialog = find(".help");
    if (dialog.open) dialog.close();
    else dialog.showModal();
  }
}

async function begin() {
  const text = document.getElementById("recon-data");
  const arrays = await unpack(meta.arrays, text.textContent);
  text.remove();
  const app = new App(arrays);
  if (root.classList.contains("embedded")) {
    app.world.controls.enableZoom = false; // the wheel scrolls the page until the view is taken up
    root.addEventListener("focusin", () => { app.world.controls.enableZoom = true; });
    root.addEventListener("focusout", () => { app.world.controls.enableZoom = false; });
    find(".scene").addEventListener("pointerdown", () => root.focus({ preventScroll: true }));
  }
  const drawn = (layer) => {
    const found = {};
    for (const { start, count, materialIndex } of layer.object.visible ? layer.geometry.groups : []) {
      found[layer.materials[materialIndex].name] = Array.from(layer.indices.subarray(start, start + count));
    }
    return found;
  };
  // For tests: what the library's boundary(alpha) gives, and what stands in the buffers that are drawn.
  window.recon = {
    get alpha() { return app.alpha; },
    set alpha(value) { app.setAlpha(value); },
    get critical() { return app.family.critical; },
    facets: (alpha) => app.family.boundary(alpha),
    betti: (alpha) => { const r = app.family.rank(alpha); return app.family.betti.map((curve) => (r ? curve[r - 1] : 0)); },
    drawn: () => Object.fromEntries(Object.entries(app.world.layers).map(([name, layer]) => [name, drawn(layer)])),
    time: (frames) => app.world.time(frames),
  };
  root.dataset.ready = "true";
}

begin().catch((error) => {
  const box = find(".notice");
  box.hidden = false;
  box.querySelector("span").textContent = /webgl/i.test(error.message)
    ? "This browser gives no WebGL, which the view needs: switch on hardware acceleration, or try another browser."
    : `The view could not be made: ${error.message}`;
  console.error(error);
});
