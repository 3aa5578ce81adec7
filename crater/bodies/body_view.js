// The body of body_view.py: its ground before or after the impact, the axis of its own frame, and the site.
turningView("body", function (d, tools) {
  "use strict";
  function numbers(text, kind) { return new kind(tools.bytes(text).buffer); }
  var before = numbers(d.before, Int16Array), after = numbers(d.after, Int16Array), corners = numbers(d.triangles, Uint16Array);
  var shades = { change: tools.bytes(d.change), anew: tools.bytes(d.anew) };
  var s = d.site, far = Math.hypot(s[0], s[1], s[2]), site = s.map(function (q) { return q / far; });
  var east = Math.hypot(s[0], s[1]) > 1e-6 * far ? [-s[1], s[0], 0] : [0, 1, 0], size = Math.hypot(east[0], east[1]);
  east = east.map(function (q) { return q / size; });
  var sun = site.map(function (q, k) { return q + 0.7 * east[k] + (k === 2 ? 0.5 : 0); }), bright = Math.hypot(sun[0], sun[1], sun[2]);
  function lit(m) { // from beside the site, and faintly from behind
    var c = (m[0] * sun[0] + m[1] * sun[1] + m[2] * sun[2]) / bright;
    return 0.42 + (c > 0 ? 0.66 * c : -0.3 * c);
  }
  function line(out, from, to, colour) { // a thin cross of two bands
    var way = [to[0] - from[0], to[1] - from[1], to[2] - from[2]], length = Math.hypot(way[0], way[1], way[2]);
    var help = Math.abs(way[2]) > 0.9 * length ? [1, 0, 0] : [0, 0, 1], thin = 0.006;
    var u = [way[1] * help[2] - way[2] * help[1], way[2] * help[0] - way[0] * help[2], way[0] * help[1] - way[1] * help[0]];
    var v = [way[1] * u[2] - way[2] * u[1], way[2] * u[0] - way[0] * u[2], way[0] * u[1] - way[1] * u[0]];
    [u, v].forEach(function (side) {
      var wide = Math.hypot(side[0], side[1], side[2]);
      var f = [[from, -1], [from, 1], [to, 1], [to, -1]].map(function (end) {
        return [0, 1, 2].map(function (k) { return end[0][k] + end[1] * thin * side[k] / wide; });
      });
      tools.triangle(out, f[0], f[1], f[2], [colour, colour, colour]);
      tools.triangle(out, f[0], f[2], f[3], [colour, colour, colour]);
    });
  }

  return {
    controls: ["colour", "after", "stretch"],
    build: function (kind, shown, stretch) {
      var out = [], by = shown ? Number(stretch) : 0, places = [], hues = [], pole = 0;
      for (var i = 0; i < before.length; i += 3) {
        places.push([0, 1, 2].map(function (k) { return (before[i + k] + by * (after[i + k] - before[i + k])) / 32767; }));
        hues.push(shown ? tools.colour(kind, shades[kind][i / 3]) : [0.8, 0.8, 0.8]);
        pole = Math.max(pole, Math.abs(places[i / 3][2]));
      }
      for (var t = 0; t < corners.length; t += 3) {
        var a = corners[t], b = corners[t + 1], c = corners[t + 2];
        tools.triangle(out, places[a], places[b], places[c], [hues[a], hues[b], hues[c]], lit);
      }
      line(out, [0, 0, -pole - 0.12], [0, 0, pole + 0.12], [0, 0, 0]);
      line(out, s, s.map(function (q, k) { return q + 0.2 * site[k]; }), [0.75, 0.1, 0.1]);
      return new Float32Array(out);
    },
    legend: function (kind, shown) {
      var limit = Number((d.limit * d.scale).toPrecision(2)), deep = Number((d.deepest * d.scale).toPrecision(2));
      if (!shown) return "";
      return kind === "change" ? tools.bar("change", "−" + limit, limit, "change of height") : tools.bar("anew", 0, deep, "resurfaced down to");
    },
    // the site towards the reader, a little from above
    start: { yaw: Math.atan2(s[1], s[0]) + Math.PI / 2, pitch: Math.max(-1.2, Math.min(1.2, Math.asin(site[2]) + 0.25)), zoom: 1 },
    pitch: [-1.57, 1.57],
    fit: [3.7, 3.6],
    lift: 0
  };
});
