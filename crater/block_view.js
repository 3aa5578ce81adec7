// Draws the block of block_view.py with plain WebGL: heights above the datum, bent over its sphere, and the cut face.
(function () {
  "use strict";
  var box = document.getElementById("block"), canvas = document.getElementById("block-canvas");
  var gl = canvas.getContext("webgl", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) { box.dataset.why = "no WebGL"; return; } // the pictures of the page remain
  box.hidden = false;
  var d = JSON.parse(document.getElementById("block-data").textContent);
  function bytes(text) {
    var raw = atob(text), out = new Uint8Array(raw.length);
    for (var i = 0; i < raw.length; i++) out[i] = raw.charCodeAt(i);
    return out;
  }
  var counts = new Uint16Array(bytes(d.height.counts).buffer), top = bytes(d.top), cells = bytes(d.section.cells);
  var colours = { origin: bytes(d.colours.origin), height: bytes(d.colours.height) };
  var n = d.grid, start = { yaw: -0.35, pitch: 0.55, zoom: 1 }, view = Object.assign({}, start), meshes = {}, vertices = 0;

  function height(k) { return counts[k] === 65535 ? NaN : d.height.low + counts[k] * d.height.step; }
  function place(x, y, h, stretch) { // in units of half the width
    h *= stretch;
    if (!d.radius) return [x / d.half, y / d.half, h / d.half];
    var s = Math.hypot(x, y), psi = s / d.radius, share = s ? Math.sin(psi) / s * (d.radius + h) : 1;
    return [x * share / d.half, y * share / d.half, ((d.radius + h) * Math.cos(psi) - d.radius) / d.half];
  }
  function colour(kind, index) {
    if (index >= 254) return [0.72, 0.72, 0.72];
    var c = colours[kind];
    return [c[3 * index] / 255, c[3 * index + 1] / 255, c[3 * index + 2] / 255];
  }
  function triangle(out, a, b, c, colours3, lit) {
    var u = [b[0] - a[0], b[1] - a[1], b[2] - a[2]], v = [c[0] - a[0], c[1] - a[1], c[2] - a[2]];
    var m = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    var size = Math.hypot(m[0], m[1], m[2]) || 1, shade = 1;
    if (lit) shade = 0.45 + 0.6 * Math.max(0, (0.45 * m[0] - 0.35 * m[1] + 0.82 * m[2]) / size);
    [a, b, c].forEach(function (p, k) {
      var q = colours3[k];
      out.push(p[0], p[1], p[2], Math.min(1, q[0] * shade), Math.min(1, q[1] * shade), Math.min(1, q[2] * shade));
    });
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
      triangle(out, p[0], p[1], p[3], [c[0], c[1], c[3]], true);
      triangle(out, p[0], p[3], p[2], [c[0], c[3], c[2]], true);
    }
    if (cut) {
      var s = d.section, w = 2 * d.half / s.along, t = (s.high - s.low) / s.down;
      for (var r = 0; r < s.down; r++) for (var q = 0; q < s.along; q++) {
        var index = cells[r * s.along + q];
        if (index === 255) continue;
        var u = q * w - d.half, h = s.low + r * t, e = colour("origin", index);
        var f = [place(u, 0, h, stretch), place(u + w, 0, h, stretch), place(u + w, 0, h + t, stretch), place(u, 0, h + t, stretch)];
        triangle(out, f[0], f[1], f[2], [e, e, e], false);
        triangle(out, f[0], f[2], f[3], [e, e, e], false);
      }
    }
    if (d.circle) { // a thin band on the datum, a little above it
      var ring = 180, black = [[0, 0, 0], [0, 0, 0], [0, 0, 0]], lift = 0.004 * d.half / stretch;
      for (var g = 0; g < ring; g++) {
        var a = 2 * Math.PI * g / ring, b = 2 * Math.PI * (g + 1) / ring;
        if (cut && Math.sin(0.5 * (a + b)) < 0) continue;
        var at = function (angle, size) { return place(size * d.circle * Math.cos(angle), size * d.circle * Math.sin(angle), lift, stretch); };
        triangle(out, at(a, 0.994), at(b, 0.994), at(b, 1.006), black, false);
        triangle(out, at(a, 0.994), at(b, 1.006), at(a, 1.006), black, false);
      }
    }
    return new Float32Array(out);
  }

  function shader(kind, text) {
    var s = gl.createShader(kind);
    gl.shaderSource(s, text); gl.compileShader(s); gl.attachShader(program, s);
  }
  var program = gl.createProgram();
  shader(gl.VERTEX_SHADER, "attribute vec3 p, c; uniform mat4 m; varying vec3 v; void main() { v = c; gl_Position = m * vec4(p, 1.0); }");
  shader(gl.FRAGMENT_SHADER, "precision mediump float; varying vec3 v; void main() { gl_FragColor = vec4(v, 1.0); }");
  gl.linkProgram(program); gl.useProgram(program);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  ["p", "c"].forEach(function (name, k) {
    var where = gl.getAttribLocation(program, name);
    gl.enableVertexAttribArray(where); gl.vertexAttribPointer(where, 3, gl.FLOAT, false, 24, 12 * k);
  });
  gl.enable(gl.DEPTH_TEST); gl.clearColor(1, 1, 1, 1);

  var controls = ["colour", "cut", "stretch"].map(function (name) { return document.getElementById("block-" + name); });
  function load() {
    var kind = controls[0].value, key = kind + controls[1].checked + controls[2].value;
    if (!meshes[key]) meshes[key] = build(kind, controls[1].checked, Number(controls[2].value));
    gl.bufferData(gl.ARRAY_BUFFER, meshes[key], gl.STATIC_DRAW);
    vertices = meshes[key].length / 6;
    legend(kind);
    draw();
  }
  function legend(kind) {
    function bar(name, low, high, words) {
      var stops = [0, 0.25, 0.5, 0.75, 1].map(function (s) {
        return "rgb(" + colour(name, Math.round(253 * s)).map(function (q) { return Math.round(255 * q); }).join(",") + ")";
      });
      return words + " " + low + " <i style='background:linear-gradient(90deg," + stops.join(",") + ")'></i> " + high + " " + d.unit + " ";
    }
    var text = "", limit = (d.limit * d.scale).toPrecision(2), deep = (d.deepest * d.scale).toPrecision(3);
    if (kind === "origin" || controls[1].checked) text += bar("origin", 0, Number(deep), "depth of origin");
    if (kind === "height") text += bar("height", "−" + Number(limit), Number(limit), "height");
    document.getElementById("block-key").innerHTML = text;
  }
  function draw() {
    var ratio = Math.min(2, window.devicePixelRatio || 1), w = Math.round(canvas.clientWidth * ratio), h = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    gl.viewport(0, 0, w, h); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    var cy = Math.cos(view.yaw), sy = Math.sin(view.yaw), cp = Math.cos(view.pitch), sp = Math.sin(view.pitch);
    var far = 4, f = view.zoom * Math.min(5.6, 3.5 * w / h); // the block fits across a phone too
    // rows: right, up, depth; the eye looks along +y, down by the pitch
    var R = [[cy, sy, 0], [-sy * sp, cy * sp, cp], [-sy * cp, cy * cp, -sp]], g = f * h / w;
    gl.uniformMatrix4fv(gl.getUniformLocation(program, "m"), false, new Float32Array([
      g * R[0][0], f * R[1][0], R[2][0], R[2][0], g * R[0][1], f * R[1][1], R[2][1], R[2][1],
      g * R[0][2], f * R[1][2], R[2][2], R[2][2], 0, 0.25 * f, far - 2, far]));
    gl.drawArrays(gl.TRIANGLES, 0, vertices);
  }

  var fingers = {}, gap = 0;
  canvas.addEventListener("pointerdown", function (e) { fingers[e.pointerId] = [e.clientX, e.clientY]; gap = 0; canvas.setPointerCapture(e.pointerId); });
  ["pointerup", "pointercancel"].forEach(function (name) { canvas.addEventListener(name, function (e) { delete fingers[e.pointerId]; gap = 0; }); });
  canvas.addEventListener("pointermove", function (e) {
    var before = fingers[e.pointerId];
    if (!before) return;
    fingers[e.pointerId] = [e.clientX, e.clientY];
    var all = Object.keys(fingers).map(function (k) { return fingers[k]; });
    if (all.length > 1) {
      var now = Math.hypot(all[0][0] - all[1][0], all[0][1] - all[1][1]);
      if (gap) zoom(now / gap);
      gap = now;
    } else {
      view.yaw -= 0.008 * (e.clientX - before[0]);
      view.pitch = Math.max(-0.3, Math.min(1.57, view.pitch + 0.008 * (e.clientY - before[1])));
    }
    draw();
  });
  function zoom(by) { view.zoom = Math.max(0.4, Math.min(8, view.zoom * by)); }
  canvas.addEventListener("wheel", function (e) { e.preventDefault(); zoom(Math.exp(-0.0012 * e.deltaY)); draw(); }, { passive: false });
  canvas.addEventListener("dblclick", function () { view = Object.assign({}, start); draw(); });
  controls.forEach(function (c) { c.addEventListener("change", load); });
  window.addEventListener("resize", draw);
  load();
  box.dataset.vertices = vertices;
  var seen = new Uint8Array(4 * canvas.width * canvas.height), drawn = 0;
  gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, seen);
  for (var k = 0; k < seen.length; k += 4) if (seen[k] + seen[k + 1] + seen[k + 2] < 765) drawn++;
  box.dataset.pixels = drawn; // a page that draws nothing says so
})();
