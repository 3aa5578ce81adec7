// A scene of triangles that the reader turns, drawn with plain WebGL. A scene says what is built for its controls, its
// legend, and how it is looked at; this file does the rest: decoding, light, drawing, mouse, fingers and wheel.
window.turningView = window.turningView || function (name, scene_of) {
  "use strict";
  var box = document.getElementById(name), canvas = document.getElementById(name + "-canvas");
  var gl = canvas.getContext("webgl", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) { box.dataset.why = "no WebGL"; return; } // the pictures of the page remain
  box.hidden = false;
  var d = JSON.parse(document.getElementById(name + "-data").textContent), colours = {};

  function bytes(text) {
    var raw = atob(text), out = new Uint8Array(raw.length);
    for (var i = 0; i < raw.length; i++) out[i] = raw.charCodeAt(i);
    return out;
  }
  Object.keys(d.colours).forEach(function (kind) { colours[kind] = bytes(d.colours[kind]); });
  function colour(kind, index) {
    if (index >= 254) return [0.72, 0.72, 0.72];
    var c = colours[kind];
    return [c[3 * index] / 255, c[3 * index + 1] / 255, c[3 * index + 2] / 255];
  }
  function lit(m) { // of a block that is seen from above
    return 0.45 + 0.6 * Math.max(0, 0.45 * m[0] - 0.35 * m[1] + 0.82 * m[2]);
  }
  function triangle(out, a, b, c, colours3, light) {
    var u = [b[0] - a[0], b[1] - a[1], b[2] - a[2]], v = [c[0] - a[0], c[1] - a[1], c[2] - a[2]];
    var m = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    var size = Math.hypot(m[0], m[1], m[2]) || 1, shade = light ? light([m[0] / size, m[1] / size, m[2] / size]) : 1;
    [a, b, c].forEach(function (p, k) {
      var q = colours3[k];
      out.push(p[0], p[1], p[2], Math.min(1, q[0] * shade), Math.min(1, q[1] * shade), Math.min(1, q[2] * shade));
    });
  }
  function bar(kind, low, high, words) {
    var stops = [0, 0.25, 0.5, 0.75, 1].map(function (s) {
      return "rgb(" + colour(kind, Math.round(253 * s)).map(function (q) { return Math.round(255 * q); }).join(",") + ")";
    });
    return words + " " + low + " <i style='background:linear-gradient(90deg," + stops.join(",") + ")'></i> " + high + " " + d.unit + " ";
  }

  var scene = scene_of(d, { bytes: bytes, colour: colour, triangle: triangle, lit: lit, bar: bar });
  var view = Object.assign({}, scene.start), meshes = {}, vertices = 0;

  function shader(kind, text) {
    var s = gl.createShader(kind);
    gl.shaderSource(s, text); gl.compileShader(s); gl.attachShader(program, s);
  }
  var program = gl.createProgram();
  shader(gl.VERTEX_SHADER, "attribute vec3 p, c; uniform mat4 m; varying vec3 v; void main() { v = c; gl_Position = m * vec4(p, 1.0); }");
  shader(gl.FRAGMENT_SHADER, "precision mediump float; varying vec3 v; void main() { gl_FragColor = vec4(v, 1.0); }");
  gl.linkProgram(program); gl.useProgram(program);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  ["p", "c"].forEach(function (attribute, k) {
    var where = gl.getAttribLocation(program, attribute);
    gl.enableVertexAttribArray(where); gl.vertexAttribPointer(where, 3, gl.FLOAT, false, 24, 12 * k);
  });
  gl.enable(gl.DEPTH_TEST); gl.clearColor(1, 1, 1, 1);

  var controls = scene.controls.map(function (control) { return document.getElementById(name + "-" + control); });
  function load() {
    var values = controls.map(function (c) { return c.type === "checkbox" ? c.checked : c.value; }), key = values.join();
    if (!meshes[key]) meshes[key] = scene.build.apply(null, values);
    gl.bufferData(gl.ARRAY_BUFFER, meshes[key], gl.STATIC_DRAW);
    vertices = meshes[key].length / 6;
    document.getElementById(name + "-key").innerHTML = scene.legend.apply(null, values);
    draw();
  }
  function draw() {
    var ratio = Math.min(2, window.devicePixelRatio || 1), w = Math.round(canvas.clientWidth * ratio), h = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    gl.viewport(0, 0, w, h); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    var cy = Math.cos(view.yaw), sy = Math.sin(view.yaw), cp = Math.cos(view.pitch), sp = Math.sin(view.pitch);
    var far = 4, f = view.zoom * Math.min(scene.fit[0], scene.fit[1] * w / h);
    // rows: right, up, depth; the eye looks along +y, down by the pitch
    var R = [[cy, sy, 0], [-sy * sp, cy * sp, cp], [-sy * cp, cy * cp, -sp]], g = f * h / w;
    gl.uniformMatrix4fv(gl.getUniformLocation(program, "m"), false, new Float32Array([
      g * R[0][0], f * R[1][0], R[2][0], R[2][0], g * R[0][1], f * R[1][1], R[2][1], R[2][1],
      g * R[0][2], f * R[1][2], R[2][2], R[2][2], 0, scene.lift * f, far - 2, far]));
    gl.drawArrays(gl.TRIANGLES, 0, vertices);
  }

  var fingers = {}, gap = 0;
  canvas.addEventListener("pointerdown", function (e) { fingers[e.pointerId] = [e.clientX, e.clientY]; gap = 0; canvas.setPointerCapture(e.pointerId); });
  ["pointerup", "pointercancel"].forEach(function (kind) { canvas.addEventListener(kind, function (e) { delete fingers[e.pointerId]; gap = 0; }); });
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
      view.pitch = Math.max(scene.pitch[0], Math.min(scene.pitch[1], view.pitch + 0.008 * (e.clientY - before[1])));
    }
    draw();
  });
  function zoom(by) { view.zoom = Math.max(0.4, Math.min(8, view.zoom * by)); }
  canvas.addEventListener("wheel", function (e) { e.preventDefault(); zoom(Math.exp(-0.0012 * e.deltaY)); draw(); }, { passive: false });
  canvas.addEventListener("dblclick", function () { view = Object.assign({}, scene.start); draw(); });
  controls.forEach(function (c) { c.addEventListener("change", load); });
  window.addEventListener("resize", draw);
  load();
  box.dataset.vertices = vertices;
  var seen = new Uint8Array(4 * canvas.width * canvas.height), drawn = 0;
  gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, seen);
  for (var k = 0; k < seen.length; k += 4) if (seen[k] + seen[k + 1] + seen[k + 2] < 765) drawn++;
  box.dataset.pixels = drawn; // a page that draws nothing says so
};
