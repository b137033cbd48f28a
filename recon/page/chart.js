// The chart beside the slider.
"use strict";

// Betti numbers over alpha, on a logarithmic axis; below, where the critical values lie; and the marks.
function drawChart(canvas, family, scale, marks) {
  const ratio = Math.min(2, window.devicePixelRatio || 1);
  const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
  if (!width || !height) return;
  canvas.width = width;
  canvas.height = height;
  const pen = canvas.getContext("2d"), rug = Math.round(10 * ratio), floor = height - rug - 4 * ratio;
  const ranks = new Int32Array(width + 1);
  for (let x = 0; x <= width; x++) ranks[x] = family.rank(scale.alpha(x / width));
  let top = 1;
  for (const curve of family.betti) for (let i = 0; i < curve.length; i++) if (curve[i] > top) top = curve[i];
  const y = (value) => floor - (floor - 3 * ratio) * (Math.log1p(value) / Math.log1p(top));
  pen.font = `${10 * ratio}px system-ui, sans-serif`;
  pen.fillStyle = shade("dim");
  pen.strokeStyle = shade("line");
  pen.lineWidth = 1;
  let written = Infinity;
  for (let value = 1; value <= top; value *= 10) {
    const at = Math.round(y(value)) + 0.5;
    pen.beginPath();
    pen.moveTo(0, at);
    pen.lineTo(width, at);
    pen.stroke();
    const line = at < 12 * ratio ? at + 10 * ratio : at - 2 * ratio;
    if (written - line < 10 * ratio) continue; // no room above the last one
    pen.fillText(value.toLocaleString("en-US"), 2 * ratio, line);
    written = line;
  }
  const zero = Math.round(width * scale.place(0)) + 0.5;
  if (family.critical[0] < 0 && family.critical[family.critical.length - 1] > 0) {
    pen.setLineDash([3 * ratio, 3 * ratio]);
    pen.beginPath();
    pen.moveTo(zero, 0);
    pen.lineTo(zero, floor);
    pen.stroke();
    pen.setLineDash([]);
    pen.fillText("α = 0", zero + 4 * ratio, 9 * ratio);
  }
  pen.lineWidth = 1.5 * ratio;
  family.betti.forEach((curve, k) => {
    pen.strokeStyle = shade(`b${k}`);
    pen.beginPath();
    let at = null;
    for (let x = 0; x < width; x++) {
      let least = ranks[x] ? curve[ranks[x] - 1] : 0, most = least;
      for (let r = ranks[x]; r < ranks[x + 1]; r++) {
        if (curve[r] < least) least = curve[r];
        if (curve[r] > most) most = curve[r];
      }
      const last = ranks[x + 1] ? curve[ranks[x + 1] - 1] : 0;
      if (at === null) pen.moveTo(x, y(least));
      for (const value of [most, least, last]) if (value !== at || most !== least) pen.lineTo(x + 0.5, y(value));
      pen.lineTo(x + 1, y(last));
      at = last;
    }
    pen.stroke();
  });
  let densest = 1;
  for (let x = 0; x < width; x++) densest = Math.max(densest, ranks[x + 1] - ranks[x]);
  pen.fillStyle = shade("ink");
  for (let x = 0; x < width; x++) {
    const count = ranks[x + 1] - ranks[x];
    if (!count) continue;
    pen.globalAlpha = 0.18 + (0.82 * Math.log1p(count)) / Math.log1p(densest);
    pen.fillRect(x, height - rug, Math.max(1, count < 3 ? ratio : 1), rug);
  }
  pen.globalAlpha = 1;
  pen.fillStyle = shade("accent");
  for (const mark of marks) {
    const x = width * scale.place(mark.alpha), h = 6 * ratio;
    pen.beginPath();
    pen.moveTo(x, height - rug - 1);
    pen.lineTo(x - 0.7 * h, height - rug - 1 - h);
    pen.lineTo(x + 0.7 * h, height - rug - 1 - h);
    pen.fill();
  }
}
