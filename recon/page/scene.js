// Points, segments and triangles in space, by three.js (global THREE; see README.md).
"use strict";

const SEQUENTIAL = ["#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725"];
const DIVERGING = ["#2166ac", "#67a9cf", "#d1e5f0", "#f2f2f0", "#fddbc7", "#ef8a62", "#b2182b"];
const parse = (hex) => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16));

function blend(stops, t) {
  const x = Math.min(1, Math.max(0, t)) * (stops.length - 1), i = Math.min(stops.length - 2, Math.floor(x));
  return stops[i].map((value, k) => Math.round(value + (x - i) * (stops[i + 1][k] - value)));
}

const rampOf = (colour) => (colour.diverging ? DIVERGING : SEQUENTIAL).map(parse);

// One colour a place: red, green and blue as they are, or 0 .. 254 along a scale and 255 for grey.
function paint(colour, columns) {
  if (colour.rgb) return interleave(columns);
  const codes = columns[0], out = new Uint8Array(3 * codes.length), ramp = rampOf(colour);
  const table = Array.from({ length: 256 }, (_, i) => (i < 255 ? blend(ramp, i / 254) : [128, 128, 128]));
  for (let i = 0; i < codes.length; i++) out.set(table[codes[i]], 3 * i);
  return out;
}

const shade = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

// Points, segments or triangles over the common positions, in groups of one material each.
class Layer {
  constructor(world, width, capacity, materials) {
    this.geometry = new THREE.BufferGeometry();
    this.geometry.setAttribute("position", world.positions);
    this.geometry.setAttribute("color", world.colours);
    this.indices = new Uint32Array(capacity);
    this.geometry.setIndex(new THREE.BufferAttribute(this.indices, 1));
    this.materials = materials;
    const kind = [THREE.Points, THREE.LineSegments, THREE.Mesh][width - 1];
    this.object = new kind(this.geometry, materials);
    this.object.frustumCulled = false;
    world.scene.add(this.object);
  }
  // Draw these parts; changed says that the indices in them are others than before, and go to the graphics card.
  drawn(starts, sizes, changed) {
    const { index } = this.geometry;
    if (changed) index.clearUpdateRanges();
    this.geometry.clearGroups();
    sizes.forEach((size, k) => {
      if (!size) return;
      if (changed) index.addUpdateRange(starts[k], size);
      this.geometry.addGroup(starts[k], size, k);
    });
    this.object.visible = this.geometry.groups.length > 0;
    if (changed && this.object.visible) index.needsUpdate = true;
  }
}

// Does the processor draw, for want of a graphics card? Then edges are not smoothed, which takes half the time.
function isSoftware() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const names = gl && gl.getExtension("WEBGL_debug_renderer_info");
  const name = names ? gl.getParameter(names.UNMASKED_RENDERER_WEBGL) : "";
  if (gl) gl.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

class World {
  constructor(canvas, arrays, spacing) {
    this.spacing = spacing;
    THREE.ColorManagement.enabled = false;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: !isSoftware(), powerPreference: "high-performance" });
    this.renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    this.scene = new THREE.Scene();
    this.positions = new THREE.BufferAttribute(interleave(arrays.positions), 3);
    this.colours = new THREE.BufferAttribute(new Uint8Array(3 * this.positions.count).fill(255), 3, true);
    this.layers = {};
    this.dots = [];
    this.bounds();
    this.camera = new THREE.PerspectiveCamera(35, 1, 0.01, 100);
    const sky = new THREE.HemisphereLight(0xffffff, 0xb8b4ae, 2.1), lamp = new THREE.DirectionalLight(0xffffff, 1.5);
    lamp.position.set(-0.5, 0.7, 1);
    this.camera.add(lamp);
    this.camera.add(lamp.target);
    lamp.target.position.set(0, 0, -1);
    this.scene.add(sky, this.camera);
    this.plane = new THREE.Plane();
    this.home();
    new ResizeObserver(() => this.fit()).observe(canvas);
  }

  bounds() {
    const p = this.positions.array, low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < p.length; i++) {
      low[i % 3] = Math.min(low[i % 3], p[i]);
      high[i % 3] = Math.max(high[i % 3], p[i]);
    }
    this.low = low;
    this.high = high;
    this.middle = new THREE.Vector3(...low.map((value, k) => (value + high[k]) / 2));
    this.reach = 0;
    for (let i = 0; i < p.length; i += 3) {
      this.reach = Math.max(this.reach, Math.hypot(p[i] - this.middle.x, p[i + 1] - this.middle.y, p[i + 2] - this.middle.z));
    }
    this.reach ||= 0.5;
    const extent = high.map((value, k) => value - low[k]);
    this.isFlat = extent[2] < 1e-5 * Math.max(...extent);
    this.upright = extent[2] === Math.min(...extent) && extent[2] < 0.45 * Math.max(...extent) && !this.isFlat ? 2 : 1;
  }

  // All in view, from above a corner; what is flat lies down, what is plane is seen from straight above.
  home() {
    const up = [0, 0, 0], from = this.isFlat ? [0, 0, 1] : [[0.4, 0.5, 1], [0.5, 0.4, 1], [0.45, -1, 0.75]][this.upright];
    up[this.upright] = 1;
    this.camera.up.set(...up);
    const distance = this.reach / Math.sin((Math.PI / 180) * 17.5) / Math.min(1, this.camera.aspect);
    this.camera.position.set(...from).normalize().multiplyScalar(distance).add(this.middle);
    this.camera.near = distance / 500;
    this.camera.far = distance * 20;
    this.camera.updateProjectionMatrix();
    this.makeControls();
    this.ask();
  }

  turn() {
    this.upright = (this.upright + 1) % 3;
    this.home();
  }

  // OrbitControls learns once what is up.
  makeControls() {
    const zooms = this.controls ? this.controls.enableZoom : true;
    if (this.controls) this.controls.dispose();
    this.controls = new THREE.OrbitControls(this.camera, this.renderer.domElement);
    this.controls.enableZoom = zooms;
    this.controls.zoomToCursor = true;
    this.controls.target.copy(this.middle);
    this.controls.addEventListener("change", () => this.ask());
    this.controls.update();
  }

  fit() {
    const canvas = this.renderer.domElement, width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width || !height) return;
    const first = !this.fitted;
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio || 1));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.fitted = true;
    if (first) this.home();
    this.render();
  }

  ask() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => { this.asked = false; this.render(); });
  }

  render() { this.renderer.render(this.scene, this.camera); }

  // Milliseconds a frame, waiting until it is drawn.
  time(frames) {
    const gl = this.renderer.getContext(), pixel = new Uint8Array(4), begin = performance.now();
    for (let i = 0; i < frames; i++) {
      this.render();
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    }
    return (performance.now() - begin) / frames;
  }

  faces(name, backs) {
    const material = new THREE.MeshLambertMaterial({ side: THREE.DoubleSide, flatShading: true });
    material.name = name;
    material.polygonOffset = name === "mesh";
    material.polygonOffsetFactor = material.polygonOffsetUnits = 1;
    if (backs) {
      material.onBeforeCompile = (shader) => {
        shader.fragmentShader = shader.fragmentShader.replace(
          "#include <color_fragment>", "#include <color_fragment>\nif (!gl_FrontFacing) diffuseColor.rgb *= vec3(0.62, 0.58, 0.56);");
      };
    }
    return material;
  }

  lines(name) { const material = new THREE.LineBasicMaterial(); material.name = name; return material; }

  disks(name, size) {
    const tile = document.createElement("canvas");
    tile.width = tile.height = 32;
    const pen = tile.getContext("2d");
    pen.fillStyle = "#fff";
    pen.arc(16, 16, 15, 0, 7);
    pen.fill();
    const material = new THREE.PointsMaterial({ size, map: new THREE.CanvasTexture(tile), alphaTest: 0.5 });
    material.name = name;
    material.userData.size = size;
    this.dots.push(material);
    return material;
  }

  materialOf(width, name) {
    if (width === 3) return this.faces(name, name === "regular" || name === "mesh");
    return width === 2 ? this.lines(name) : this.disks(name, 2 * this.spacing);
  }

  recolour(byValue) {
    this.scene.background = new THREE.Color(shade("stage"));
    for (const layer of Object.values(this.layers)) {
      for (const material of layer.materials) {
        material.vertexColors = byValue;
        material.color.set(byValue ? "#ffffff" : shade(material.name));
        material.needsUpdate = true;
      }
    }
    this.ask();
  }
}
