// The block of block_view.py: heights above the datum, bent over its sphere, and the cut face.
turningView("block", function (d, tools) {
  "use strict";
  var counts = new Uint16Array(tools.bytes(d.height.counts).buffer), top = tools.bytes(d.top), cells = tools.bytes(d.section.cells);
  var n = d.grid, colour = tools.colour, triangle = tools.triangle, lit = tools.lit;

  function height(k) { return counts[k] === 65535 ? NaN : d.height.low + counts[k] * d.height.step; }
  function place(x, y, h, stretch) { // in units of half the width
    h *= stretch;
    if (!d.radius) return [x / d.half, y / d.half, h / d.half];
    var s = Math.hypot(x, y), psi = s / d.radius, share = s ? Math.sin(psi) / s * (d.radius + h) : 1;
    return [x * share / d.half, y * share / d.half, ((d.radius + h) * Math.cos(psi) - d.radius) / d.half];
  }
  function build(kind, cut, stretch) {
    var out = [], x = function (k) { return (2 * k / (n - 1) - 1) * d.half; };
    function shown(k) {
      if (kind === "origin") return colour(kind, top[k]);
      return colour(kind, Math.round(Math.max(0, Math.min(1, 0.5 + 0.5 * height(k) / d.limit)) * 253));
    }
    for (var j = cut ? (n - 1) / 2 : 0; j < n - 1; j++) for (var i = 0; i < n - 1; i++) {
      var k = [j * n + i, j * n + i + 1, (j + 1) * n + i, (j + 1) * n + i + 1];
      if (k.some(function (q) { return counts[q] === 65535; })) continue;
      var p = k.map(function (q) { return place(x(q % n), x(Math.floor(q / n)), height(q), stretch); }), c = k.map(shown);
      triangle(out, p[0], p[1], p[3], [c[0], c[1], c[3]], lit);
      triangle(out, p[0], p[3], p[2], [c[0], c[3], c[2]], lit);
    }
    if (cut) {
      var s = d.section, w = 2 * d.half / s.along, t = (s.high - s.low) / s.down;
      for (var r = 0; r < s.down; r++) for (var q = 0; q < s.along; q++) {
        var index = cells[r * s.along + q];
        if (index === 255) continue;
        var u = q * w - d.half, h = s.low + r * t, e = colour("origin", index);
        var f = [place(u, 0, h, stretch), place(u + w, 0, h, stretch), place(u + w, 0, h + t, stretch), place(u, 0, h + t, stretch)];
        triangle(out, f[0], f[1], f[2], [e, e, e]);
        triangle(out, f[0], f[2], f[3], [e, e, e]);
      }
    }
    if (d.circle) { // a thin band on the datum, a little above it
      var ring = 180, black = [[0, 0, 0], [0, 0, 0], [0, 0, 0]], lift = 0.004 * d.half / stretch;
      for (var g = 0; g < ring; g++) {
        var a = 2 * Math.PI * g / ring, b = 2 * Math.PI * (g + 1) / ring;
        if (cut && Math.sin(0.5 * (a + b)) < 0) continue;
        var at = function (angle, size) { return place(size * d.circle * Math.cos(angle), size * d.circle * Math.sin(angle), lift, stretch); };
        triangle(out, at(a, 0.994), at(b, 0.994), at(b, 1.006), black);
        triangle(out, at(a, 0.994), at(b, 1.006), at(a, 1.006), black);
      }
    }
    return new Float32Array(out);
  }

  function legend(kind, cut) {
    var text = "", limit = (d.limit * d.scale).toPrecision(2), deep = (d.deepest * d.scale).toPrecision(3);
    if (kind === "origin" || cut) text += tools.bar("origin", 0, Number(deep), "depth of origin");
    if (kind === "height") text += tools.bar("height", "−" + Number(limit), Number(limit), "height");
    return text;
  }

  return {
    controls: ["colour", "cut", "stretch"],
    build: function (kind, cut, stretch) { return build(kind, cut, Number(stretch)); },
    legend: legend,
    start: { yaw: -0.35, pitch: 0.55, zoom: 1 },
    pitch: [-0.3, 1.57],
    fit: [5.6, 3.5], // the block fits across a phone too
    lift: 0.25
  };
});
