// Plays a run: maps with the moving car, plots whose cursors follow one time, and what is dragged in any of them.
(() => {
'use strict';
const SVG = 'http://www.w3.org/2000/svg';
const root = document.getElementById('player');
const data = JSON.parse(document.getElementById('player-data').textContent);
const [FIRST, LAST, STEP] = data.time;
/** What the last stage of a test is called. */
const END = 'end of the test';

// --- Numbers and texts -------------------------------------------------------------------------------------------------------

/** The numbers of quantized values; null becomes NaN. */
function numbers({ e, o, v }) {
  const result = new Float64Array(v.length);
  const [factor, divisor] = e < 0 ? [1, 10 ** -e] : [10 ** e, 1];
  for (let k = 0; k < v.length; k++) result[k] = v[k] === null ? NaN : (v[k] + o) * factor / divisor;
  return result;
}

/** Text of others with what nobody would see as numbers. */
function visible(text) {
  const hidden = /[\u0000-\u001f\u007f-\u009f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]/g;
  return String(text).replace(hidden, (it) => '\\u{' + it.codePointAt(0).toString(16) + '}');
}

/** A number with three or four digits; of 12345.6 all digits before the point. */
function shown(value) {
  if (!Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  if (size === 0) return '0';
  if (size < 1e-4 || size >= 1e6) return value.toExponential(2).replace('e+', 'e').replace('-', '−');
  const decimals = clamp(2 - Math.floor(Math.log10(size)), size >= 100 ? 1 : 2, 6);
  return value.toFixed(size >= 1000 ? 0 : decimals).replace('-', '−');
}

/** Round numbers from low to high, about so many. */
function ticks(low, high, about) {
  const rough = (high - low) / Math.max(1, about);
  const decade = 10 ** Math.floor(Math.log10(rough));
  const step = decade * ([1, 2, 5].find((it) => it * decade >= rough * 0.999) || 10);
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const result = [];
  for (let k = Math.ceil(low / step - 1e-9); k <= Math.floor(high / step + 1e-9); k++) {
    const value = k * step;
    const large = Math.abs(value) >= 1e6 || (decimals > 7 && value !== 0);
    const text = large ? value.toExponential(1).replace('e+', 'e') : value.toFixed(Math.min(decimals, 12));
    result.push([value, text.replace('-', '−')]);
  }
  return result;
}

function logarithmicTicks(low, high) {
  const result = [];
  for (let decade = Math.floor(Math.log10(low)); decade <= Math.ceil(Math.log10(high)); decade++) {
    for (const digit of [1, 2, 5]) {
      const value = digit * 10 ** decade;
      if (value >= low * 0.999 && value <= high * 1.001) result.push([value, String(Number(value.toPrecision(1)))]);
    }
  }
  return result;
}

const clamp = (value, low, high) => Math.min(high, Math.max(low, value));
const extent = (arrays) => {
  let [low, high] = [Infinity, -Infinity];
  for (const values of arrays) for (const it of values) { if (it < low) low = it; if (it > high) high = it; }
  return [low, high];
};
/** Index of the last element that is not above a value; the elements rise. */
function lastNotAbove(values, value) {
  let [low, high] = [0, values.length];
  while (low < high) { const middle = (low + high) >> 1; if (values[middle] <= value) low = middle + 1; else high = middle; }
  return low - 1;
}

// --- Elements ----------------------------------------------------------------------------------------------------------------

function element(name, attributes, ...children) {
  const it = document.createElement(name);
  for (const [key, value] of Object.entries(attributes || {})) it.setAttribute(key, value);
  it.append(...children);
  return it;
}
function drawn(name, attributes, parent, text) {
  const it = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes || {})) it.setAttribute(key, value);
  if (text !== undefined) it.textContent = text;
  if (parent) parent.append(it);
  return it;
}
function polyline(x, y, from, to, place) {
  let path = '', down = false;
  for (let k = from; k < to; k++) {
    const [a, b] = place(x[k], y[k]);
    if (Number.isFinite(a) && Number.isFinite(b)) { path += (down ? 'L' : 'M') + a.toFixed(1) + ' ' + b.toFixed(1); down = true; } else down = false;
  }
  return path;
}

// --- Time --------------------------------------------------------------------------------------------------------------------

const followers = [];
let now = FIRST, playing = false, speed = 1, dragging = false;
/** The shown part of time plots: its duration, and its beginning. */
let span = LAST - FIRST, begin = FIRST;
const digits = clamp(Math.ceil(-Math.log10(STEP) - 1e-9), 0, 6);

function setTime(time) {
  now = clamp(time, FIRST, LAST);
  scrollWindow();
  followers.forEach((follow) => follow(now));
}
function setSpan(duration, from = now - duration / 2) {
  span = clamp(duration, Math.min(10 * STEP, LAST - FIRST), LAST - FIRST);
  begin = clamp(from, FIRST, LAST - span);
  charts.forEach((chart) => { chart.stale = chart.follows; });
  drawStale();
  setTime(now);
}
/** Keeps the time inside of the shown part, but not under the finger that drags it. */
function scrollWindow() {
  const before = begin;
  if (span < LAST - FIRST && !dragging) {
    const margin = playing ? 0.5 : 0.05;
    if (now < begin + 0.05 * span) begin = now - 0.05 * span;
    if (now > begin + (1 - margin) * span) begin = now - (1 - margin) * span;
  }
  begin = clamp(begin, FIRST, LAST - span);
  if (begin !== before) { charts.forEach((chart) => { if (chart.follows) chart.stale = true; }); drawStale(); }
}
let last = null;
function frame(at) {
  if (!playing) return;
  const elapsed = last === null ? 0 : Math.min(0.25, (at - last) / 1000);
  last = at;
  const time = now + speed * elapsed;
  if (time >= LAST) play(false);
  setTime(time);
  requestAnimationFrame(frame);
}
function play(starts) {
  playing = starts;
  last = null;
  button.textContent = playing ? '❚❚' : '▶';
  button.setAttribute('aria-label', playing ? 'Pause' : 'Play');
  if (playing) { if (now >= LAST) setTime(FIRST); requestAnimationFrame(frame); }
}
/** What is dragged in an element sets the time, by a function of the place [px]. */
function drag(target, timeAt) {
  const move = (event) => {
    const box = target.getBoundingClientRect();
    const time = timeAt(event.clientX - box.left, event.clientY - box.top);
    if (Number.isFinite(time)) setTime(time);
  };
  target.addEventListener('pointerdown', (event) => {
    if (event.button !== 0) return;
    target.setPointerCapture(event.pointerId);
    play(false);
    dragging = true;
    move(event);
  });
  target.addEventListener('pointermove', (event) => { if (dragging && target.hasPointerCapture(event.pointerId)) move(event); });
  for (const end of ['pointerup', 'pointercancel']) target.addEventListener(end, () => { dragging = false; });
}

// --- Charts ------------------------------------------------------------------------------------------------------------------

const charts = [];
const watch = new IntersectionObserver((entries) => {
  for (const entry of entries) {
    const chart = charts.find((it) => it.svg === entry.target);
    if (!chart) continue;
    chart.seen = entry.isIntersecting;
    chart.follow(now);
  }
  drawStale();
}, { rootMargin: '200px' });
const resize = new ResizeObserver(() => { charts.forEach((chart) => { if (chart.svg.clientWidth !== chart.width) chart.stale = true; }); drawStale(); });
/** Draws what is out of date and in sight; out of sight, what was never drawn, as paper shows it. */
function drawStale() { charts.forEach((chart) => { if (chart.stale && (chart.seen || !chart.place)) chart.draw(); }); }
addEventListener('beforeprint', () => charts.forEach((chart) => chart.draw()));

const faultSpans = Object.entries(data.faults).flatMap(([name, spans]) => spans.map((it) => ({ span: it, kind: 'fault', name })));
const LEFT = 68, RIGHT = 18, TOP = 8, BOTTOM = 34;

/** Axes with layers {kind, css, x, y, t, name} and a cursor. `time` says whether the axis to the right is time, `follows` that it shows the common part. */
class Chart {
  constructor({ title, labels, layers, range, follows, scale, spans, height, note, failed, ranges }) {
    Object.assign(this, { title, labels, layers, follows, scale: scale || 'linear', spans: spans || [], height: height || 170 });
    this.time = this.scale === 'time';
    this.stale = true;
    this.y = range || padded(extent(layers.filter((it) => it.fits !== false).map((it) => it.y)));
    this.x = ranges ? ranges[0] : extent(layers.map((it) => it.x));
    if (ranges) this.y = ranges[1];
    if (!(this.x[1] !== this.x[0]) || !this.x.every(Number.isFinite)) this.x = [FIRST, LAST];
    if (!ranges && (this.scale === 'linear' || (this.time && !follows))) this.x = padded(this.x);
    this.values = [];
    const keys = element('span', { class: 'keys' });
    for (const layer of layers) {
      if (!layer.name) continue;
      const mark = { line: 'line', dash: 'dash', dot: 'dot', thick: 'line', hair: 'line' }[layer.kind];
      const key = element('span', { class: 'key' }, element('i', { class: mark + ' ' + layer.css }), visible(layer.name));
      keys.append(key);
      if (!layer.at) continue;
      const value = element('b', { class: 'value' });
      key.append(' ', value);
      this.values.push([layer, value]);
    }
    this.svg = drawn('svg', { class: 'chart', role: 'img' });
    this.svg.setAttribute('aria-label', visible(title));
    const caption = element('figcaption', {}, element('b', {}, visible(title)), keys);
    this.figure = element('figure', { class: 'tile' + (failed ? ' failed' : '') }, caption, this.svg);
    if (note) this.figure.append(element('p', { class: 'that' }, element('code', {}, visible(note))));
    charts.push(this);
    watch.observe(this.svg);
    resize.observe(this.svg);
    drag(this.svg, (x, y) => this.timeAt(x, y));
    followers.push((time) => this.follow(time));
  }

  get window() { return this.follows ? [begin, begin + span] : this.x; }

  draw() {
    const { svg } = this;
    const width = svg.clientWidth;
    if (!width) return;
    let w = width - LEFT - RIGHT;
    if (this.equal) {
      // A circle is one: what a unit takes is the same on both axes, on wide pages too.
      const [across, up] = [this.x, this.y].map(([from, to]) => Math.abs(to - from));
      const most = Math.min(340, w * up / across);
      this.height = most + TOP + BOTTOM;
      w = Math.max(120, most * across / up);
    }
    const { height } = this;
    this.stale = false;
    this.width = width;
    this.inner = w;
    svg.setAttribute('viewBox', `0 0 ${width} ${height}`);
    svg.style.height = height + 'px';
    svg.replaceChildren();
    const h = height - TOP - BOTTOM;
    const [x0, x1] = this.window, [y0, y1] = this.y;
    const logarithmic = this.scale === 'logarithmic';
    const share = logarithmic ? (x) => Math.log(x / x0) / Math.log(x1 / x0) : (x) => (x - x0) / (x1 - x0);
    this.place = (x, y) => [LEFT + share(x) * w, TOP + (1 - (y - y0) / (y1 - y0)) * h];
    const ends = (a, b) => [Math.min(a, b), Math.max(a, b)];
    for (const [value, text] of logarithmic ? logarithmicTicks(x0, x1) : ticks(...ends(x0, x1), w / 72)) {
      const [x] = this.place(value, y0);
      drawn('path', { class: 'grid', d: `M${x.toFixed(1)} ${TOP}v${h}` }, svg);
      drawn('text', { class: 'tick', x: x.toFixed(1), y: TOP + h + 14 }, svg, text);
    }
    for (const [value, text] of ticks(...ends(y0, y1), h / 30)) {
      const [, y] = this.place(x0, value);
      drawn('path', { class: 'grid', d: `M${LEFT} ${y.toFixed(1)}h${w}` }, svg);
      drawn('text', { class: 'tick end', x: LEFT - 6, y: (y + 4).toFixed(1) }, svg, text);
    }
    drawn('path', { class: 'frame', d: `M${LEFT} ${TOP}v${h}h${w}` }, svg);
    drawn('text', { class: 'label', x: LEFT + w / 2, y: height - 5 }, svg, visible(this.labels[0]));
    const letters = Math.floor(h / 5.8), label = visible(this.labels[1]);
    const unit = label.match(/\[[^\]]*\]\s*$/);
    const short = label.length <= letters ? label : unit ? unit[0] : label.slice(0, letters - 1) + '…';
    drawn('text', { class: 'label', transform: `translate(11 ${TOP + h / 2}) rotate(-90)` }, svg, short);
    const area = drawn('svg', { class: 'area', x: LEFT, y: TOP, width: w, height: h, viewBox: `${LEFT} ${TOP} ${w} ${h}` }, svg);
    if (this.time) {
      for (const { span: [from, to], kind, name } of this.spans) {
        const [a] = this.place(from, y0), [b] = this.place(to, y0);
        const box = drawn('rect', { class: kind, x: a.toFixed(1), y: TOP, width: Math.max(1.5, b - a).toFixed(1), height: h }, area);
        drawn('title', {}, box, visible(name));
      }
    }
    if (this.ellipse) {
      const [cx, cy] = this.place(0, 0), [ex, ey] = this.place(...this.ellipse);
      drawn('ellipse', { class: 'ellipse', cx, cy, rx: Math.abs(ex - cx), ry: Math.abs(ey - cy) }, area);
    }
    for (const layer of this.layers) this.drawLayer(layer, area);
    this.shapes = this.layers.filter((layer) => layer.shapes).map((layer) => [layer, drawn('path', { class: 'dash ' + layer.css }, area)]);
    this.trails = this.layers.filter((layer) => layer.trail).map((layer) => [layer, drawn('path', { class: 'trail ' + layer.css }, area), drawn('circle', { class: 'now ' + layer.css, r: 5 }, area)]);
    this.dots = this.layers.filter((layer) => layer.t && !this.time && !layer.trail).map((layer) => [layer, drawn('circle', { class: 'now ' + layer.css, r: 5 }, area)]);
    this.cursor = this.time ? drawn('line', { class: 'cursor', x1: 0, x2: 0, y1: TOP, y2: TOP + h }, area) : null;
    this.follow(now);
  }

  drawLayer({ kind, css, x, y, trail, shapes, mark }, area) {
    if (trail || shapes) return;
    const marks = this.layers.map((it) => it.mark).filter(Boolean);
    if (kind === 'dot') {
      for (let k = 0; k < x.length; k++) {
        const [a, b] = this.place(x[k], y[k]);
        if (Number.isFinite(a) && Number.isFinite(b)) drawn('circle', { class: 'dot ' + css, cx: a.toFixed(1), cy: b.toFixed(1), r: 4.5 }, area);
        // Beside it, to the side that has more room; one name above the line, the next one below it.
        const end = a - LEFT > this.inner / 2, below = b - TOP < 20 || (marks.indexOf(mark) % 2 === 1 && b < this.height - BOTTOM - 20);
        if (mark) drawn('text', { class: 'mark ' + (end ? 'end' : 'begin'), x: (a + (end ? -8 : 8)).toFixed(1), y: (b + (below ? 17 : -7)).toFixed(1) }, area, visible(mark));
      }
      return;
    }
    let [from, to] = [0, x.length];
    if (this.follows) {
      from = Math.max(0, lastNotAbove(x, begin) - 1);
      to = Math.min(x.length, lastNotAbove(x, begin + span) + 3);
    }
    drawn('path', { class: kind + ' ' + css, d: polyline(x, y, from, to, this.place) }, area);
  }

  follow(time) {
    for (const [layer, value] of this.values) if (this.seen) value.textContent = shown(layer.at(time));
    if (!this.place || this.stale || !this.seen) return;
    if (this.cursor) this.cursor.setAttribute('transform', `translate(${this.place(time, 0)[0].toFixed(2)} 0)`);
    for (const [layer, dot] of this.dots) this.move(dot, pointAt(layer, time));
    for (const [layer, path] of this.shapes) {
      const count = layer.y.length / layer.x.length, at = clamp((time - FIRST) / layer.step, 0, count - 1);
      const k = Math.floor(at), next = Math.min(k + 1, count - 1), n = layer.x.length;
      const y = layer.x.map((_, i) => layer.y[k * n + i] + (at - k) * (layer.y[next * n + i] - layer.y[k * n + i]));
      path.setAttribute('d', polyline(layer.x, y, 0, n, this.place));
    }
    for (const [layer, path, dot] of this.trails) {
      const k = clamp(Math.floor((time - FIRST) / layer.step), 0, layer.x.length - 1);
      const from = Math.max(0, Math.floor(k - layer.trail / layer.step));
      path.setAttribute('d', polyline(layer.x, layer.y, from, k + 1, this.place));
      this.move(dot, [layer.x[k], layer.y[k]]);
    }
  }

  move(dot, point) {
    const there = point && point.every(Number.isFinite);
    dot.style.display = there ? '' : 'none';
    if (there) { const [a, b] = this.place(...point); dot.setAttribute('transform', `translate(${a.toFixed(2)} ${b.toFixed(2)})`); }
  }

  timeAt(x, y) {
    if (!this.place) return NaN;
    if (this.time) { const [from, to] = this.window; return from + (x - LEFT) / this.inner * (to - from); }
    let [best, nearest] = [NaN, Infinity];
    for (const layer of this.layers) {
      if (!layer.t && !layer.trail) continue;
      for (let k = 0; k < layer.x.length; k++) {
        const [a, b] = this.place(layer.x[k], layer.y[k]);
        const away = (a - x) ** 2 + (b - y) ** 2;
        if (away < nearest) [best, nearest] = [layer.t ? layer.t[k] : FIRST + k * layer.step, away];
      }
    }
    return best;
  }
}

function padded([low, high]) {
  if (!Number.isFinite(low)) return [0, 1];
  const space = 0.06 * (high - low) || 0.05 * Math.abs(high) || 1;
  return [low - space, high + space];
}
/** The point of a layer with times, on the line between two of them; none outside. */
function pointAt({ t, x, y }, time) {
  const k = lastNotAbove(t, time);
  if (k < 0 || time > t[t.length - 1] + 1e-9) return null;
  const next = Math.min(k + 1, t.length - 1), share = next === k ? 0 : (time - t[k]) / (t[next] - t[k]);
  return [x[k] + share * (x[next] - x[k]), y[k] + share * (y[next] - y[k])];
}

const ROLES = { reference: 'c4', plant: 'c0', measurement: 'data', estimate: 'c2', limit: 'poor', other: '' };
/** Colours by role; what has none gets the next one that is free. One label has one colour. */
function palette() {
  const used = new Map();
  return (label, role) => {
    const key = role + '/' + label;
    if (!used.has(key)) {
      const taken = [...used.values()];
      const free = ['c0', 'c1', 'c2', 'c3', 'c4', 'truth', 'data', 'poor'].find((it) => !taken.includes(it)) || 'c0';
      used.set(key, ROLES[role] && !taken.includes(ROLES[role]) ? ROLES[role] : free);
    }
    return used.get(key);
  };
}

const [BUCKET, STRIDE] = data.bucket;
/** A curve of buckets: one point for each communication point, or two for each bucket. */
function bucketCurve(values) {
  if (STRIDE === 1) {
    const x = new Float64Array(values.length / 2), y = new Float64Array(values.length / 2);
    for (let k = 0; k < x.length; k++) { x[k] = FIRST + k * STEP; y[k] = values[2 * k]; }
    return { x, y };
  }
  const x = new Float64Array(values.length);
  for (let k = 0; k < x.length; k++) x[k] = Math.min(LAST, FIRST + (k >> 1) * BUCKET + (k % 2 ? 0.75 : 0.25) * (BUCKET - STEP));
  return { x, y: values };
}
const nearestValue = ({ x, y }) => (time) => {
  const k = clamp(lastNotAbove(x, time), 0, x.length - 1), next = Math.min(k + 1, x.length - 1);
  return y[Math.abs(x[next] - time) < Math.abs(x[k] - time) ? next : k];
};

function signalChart({ title, range, curves, limits }) {
  const color = palette();
  curves.forEach((it) => color(it.label, it.role));
  const layers = curves.map(({ label, role, bound, values }) => {
    const points = bucketCurve(numbers(values));
    const base = { css: color(label, role), ...points };
    return bound ? { ...base, kind: 'hair' } : { ...base, kind: 'line', name: label, at: nearestValue(points) };
  });
  const [low, high] = extent(layers.map((it) => it.y));
  const lines = limits.map(({ value, during }) => ({
    kind: 'dash', css: 'poor', name: '', x: during, y: [value, value],
    // A limit that is far away does not make the curve flat.
    fits: value > low - (high - low) && value < high + (high - low),
  }));
  if (lines.length) lines[0].name = 'limit of a check';
  return new Chart({ title, labels: ['time [s]', title], layers: [...layers, ...lines], range, follows: true, scale: 'time', spans: faultSpans });
}

function checkChart({ name, that, passed, unit, names, during, first, at, worst, t, value, limit, violated }) {
  const times = numbers(t);
  /** Through the lowest and the highest value of each point, first the one that is nearer to the value before. */
  const both = ([low, high]) => {
    const [a, b] = [numbers(low), numbers(high)];
    const x = [], y = [];
    for (let k = 0; k < times.length; k++) {
      if (!(b[k] > a[k])) { x.push(times[k]); y.push(a[k]); continue; }
      const apart = (k + 1 < times.length ? times[k + 1] : during[1]) - times[k];
      const before = y.length ? y[y.length - 1] : a[k];
      const rises = Math.abs(before - a[k]) <= Math.abs(before - b[k]);
      x.push(times[k] + 0.25 * apart, times[k] + 0.75 * apart);
      y.push(rises ? a[k] : b[k], rises ? b[k] : a[k]);
    }
    return { x, y };
  };
  const curve = both(value);
  const layers = [{ kind: 'line', css: 'c0', name: names[0], ...curve, at: nearestValue(curve) }];
  if (limit) layers.push({ kind: 'dash', css: 'poor', name: names[1], ...both(limit) });
  if (at !== null && worst !== null) layers.push({ kind: 'dot', css: passed ? 'c1' : 'poor', name: 'worst', x: [at], y: [worst] });
  const title = (passed ? '' : 'FAILED ') + name;
  const spans = [...faultSpans, ...violated.map((it) => ({ span: it, kind: 'violated', name: 'does not hold' }))];
  if (!passed && first !== null && !violated.length) spans.push({ span: [first, during[1]], kind: 'violated', name: 'does not hold' });
  const label = names[0] + (unit ? ` [${unit}]` : '');
  // A short window fills its plot, and the cursor passes through.
  const follows = during[1] - during[0] > 0.4 * (LAST - FIRST);
  return new Chart({ title, labels: ['time [s]', label], layers, follows, scale: 'time', spans, note: that, failed: !passed, height: passed ? 160 : 190 });
}

const KINDS = { curve: ['line', 'c0'], second: ['line', 'c2'], reference: ['dash', 'data'], fit: ['thick', 'c1'], limit: ['thick', 'poor'], mark: ['dot', 'truth'] };
function diagramChart({ title, labels, scale, range, layers }) {
  const all = layers.map(({ name, kind, x, y, t }) => {
    const [shape, css] = KINDS[kind];
    const mark = kind === 'mark';
    return { kind: shape, css, name: mark ? '' : name, mark: mark ? name : '', x: numbers(x), y: numbers(y), t: t ? numbers(t) : null };
  });
  if (scale === 'time') for (const layer of all) if (layer.t) layer.at = nearestValue(layer);
  return new Chart({ title, labels, layers: all, scale, range, height: 230, spans: scale === 'time' ? faultSpans : [] });
}

function xyChart({ title, labels, ranges, ellipse, equal, trail, step, points, curves, moving }) {
  const color = palette();
  const fixed = curves.map(({ label, role, x, y }) => ({ kind: 'dash', css: color(label, role), name: label, x: numbers(x), y: numbers(y) }));
  const shapes = moving.map(({ label, role, step, x, y }) => ({ kind: 'dash', css: color(label, role), name: label, x: numbers(x), y: numbers(y), step, shapes: true }));
  const dots = points.map(({ label, role, x, y }) => ({ kind: 'dot', css: color(label, role), name: label, x: numbers(x), y: numbers(y), trail: trail || step, step }));
  const chart = new Chart({ title, labels, layers: [...fixed, ...shapes, ...dots], ranges, height: 250 });
  Object.assign(chart, { ellipse, equal });
  return chart;
}

// --- Maps --------------------------------------------------------------------------------------------------------------------

const car = data.car && { ...data.car };
if (car) for (const key of ['x', 'y', 'heading', 'steer', 'speed']) if (car[key]) car[key] = numbers(car[key]);
const SPEEDS = 8;
const speeds = car && car.speed ? extent([car.speed]) : [NaN, NaN];

/** The pose at a time, on the line between two. */
function poseAt(time) {
  const n = car.x.length - 1;
  const k = clamp(Math.floor((time - FIRST) / car.step), 0, Math.max(0, n - 1));
  const from = FIRST + k * car.step, to = k + 1 >= n ? LAST : from + car.step;
  const share = to > from ? clamp((time - from) / (to - from), 0, 1) : 0;
  const mix = (values) => values[k] + share * (values[Math.min(k + 1, n)] - values[k]);
  // The short way round where the heading jumps by a turn.
  const turn = car.heading[Math.min(k + 1, n)] - car.heading[k];
  const heading = car.heading[k] + share * (turn - 2 * Math.PI * Math.round(turn / (2 * Math.PI)));
  return { k, x: mix(car.x), y: mix(car.y), heading, steer: car.steer ? mix(car.steer) : 0, speed: car.speed ? mix(car.speed) : NaN };
}

function carShape(parent) {
  const { length, width, axles } = car;
  const group = drawn('g', { class: 'car' }, parent);
  const body = drawn('g', {}, group);
  const wheels = axles.flatMap((x, axle) => [1, -1].map((side) => {
    const place = drawn('g', { transform: `translate(${x} ${side * 0.46 * width})` }, group);
    return [axle, drawn('rect', { class: 'wheel', x: -0.33, y: -0.12, width: 0.66, height: 0.24, rx: 0.06 }, place)];
  }));
  const [l, w] = [length / 2, width / 2];
  drawn('path', { class: 'body', d: `M${-l} ${-0.8 * w}Q${-l} ${-w} ${-0.9 * l} ${-w}H${0.6 * l}Q${l} ${-0.95 * w} ${l} ${-0.55 * w}V${0.55 * w}Q${l} ${0.95 * w} ${0.6 * l} ${w}H${-0.9 * l}Q${-l} ${w} ${-l} ${0.8 * w}Z` }, body);
  drawn('path', { class: 'glass', d: `M${0.12 * l} ${-0.72 * w}L${0.42 * l} ${-0.6 * w}V${0.6 * w}L${0.12 * l} ${0.72 * w}Z` }, body);
  return { group, front: wheels.filter(([axle]) => axle === 0).map(([, wheel]) => wheel) };
}

/** Every cone, and the width of the map around the car [m]. */
const CONES = [...data.cones, ...data.hits.map((it) => it[0])], CLOSE = 60;
/** How far way and cones lead aside within the map around the car at most [m]. */
let aside = null;
function sideways() {
  if (aside !== null) return aside;
  aside = 0;
  const stride = Math.max(1, Math.floor(car.x.length / 1500));
  for (let k = 0, first = 0; k < car.x.length; k += stride) {
    const near = (x, y) => { if (Math.abs(x - car.x[k]) < CLOSE / 2) aside = Math.max(aside, Math.abs(y - car.y[k])); };
    while (Math.hypot(car.x[k] - car.x[first], car.y[k] - car.y[first]) > CLOSE / 2 && first < k) first += stride;
    for (let i = first; i < k; i += stride) near(car.x[i], car.y[i]);
    for (const [x, y] of CONES) near(x, y);
  }
  return aside;
}

/** A map: the whole way, or a part around the car. */
class CarMap {
  constructor(whole) {
    this.whole = whole;
    this.metres = CLOSE;
    this.svg = drawn('svg', { class: 'map ' + (whole ? 'whole' : 'close'), role: 'img' });
    this.svg.setAttribute('aria-label', whole ? 'the whole way from above' : 'the car from above');
    this.grid = drawn('g', {}, this.svg);
    this.world = drawn('g', { class: 'world' }, this.svg);
    const line = (css, x, y) => {
      let path = '';
      for (let k = 0; k < x.length; k++) path += (k ? 'L' : 'M') + x[k].toFixed(2) + ' ' + y[k].toFixed(2);
      drawn('path', { class: css, d: path }, this.world);
    };
    const lines = (all) => all.map((it) => it.map(numbers));
    for (const [x, y] of lines(data.road)) line('road', x, y);
    for (const [x, y] of lines(data.course)) line('course', x, y);
    this.way();
    drawn('path', { class: 'cones', d: data.cones.map(([x, y]) => `M${x} ${y}h0`).join('') }, this.world);
    const hit = data.hits.map(([[x, y]]) => `M${x} ${y}h0`).join('');
    if (hit) drawn('title', {}, drawn('path', { class: 'cones hit', d: hit }, this.world), 'a cone that the car hits');
    this.trail = drawn('path', { class: 'trail' }, this.world);
    this.car = carShape(this.world);
    this.numbers = drawn('g', {}, this.svg);
    const everything = [0, 1].map((axis) => [axis ? car.y : car.x, ...lines(data.course).map((it) => it[axis]), CONES.map((it) => it[axis])]);
    this.bounds = everything.map(extent).map((it) => (it.every(Number.isFinite) ? it : [0, 1]));
    if (!whole) this.svg.addEventListener('wheel', (event) => { if (!event.ctrlKey) return; event.preventDefault(); this.zoom(event.deltaY > 0 ? 1.2 : 1 / 1.2); }, { passive: false });
    else drag(this.svg, (x, y) => this.timeAt(x, y));
    new ResizeObserver(() => this.draw()).observe(this.svg);
    followers.push((time) => this.follow(time));
  }

  zoom(factor) {
    this.metres = clamp(this.metres * factor, 8, 2000);
    this.draw();
  }

  /** The driven way in colours of speed. */
  way() {
    const paths = Array.from({ length: SPEEDS }, () => '');
    const [slow, fast] = speeds;
    const bin = (k) => (fast > slow ? clamp(Math.floor((car.speed[k] - slow) / (fast - slow) * SPEEDS), 0, SPEEDS - 1) : 0);
    let current = -1;
    for (let k = 0; k + 1 < car.x.length; k++) {
      const next = bin(k);
      if (next !== current) paths[next] += `M${car.x[k].toFixed(2)} ${car.y[k].toFixed(2)}`;
      paths[next] += `L${car.x[k + 1].toFixed(2)} ${car.y[k + 1].toFixed(2)}`;
      current = next;
    }
    paths.forEach((path, k) => { if (path) drawn('path', { class: 'way s' + k, d: path }, this.world); });
  }

  draw() {
    const [w, h] = [this.svg.clientWidth, this.svg.clientHeight];
    if (!w || !h) return;
    Object.assign(this, { w, h });
    this.svg.setAttribute('viewBox', `0 0 ${w} ${h}`);
    if (this.whole) {
      const [[x0, x1], [y0, y1]] = this.bounds;
      const wanted = clamp((y1 - y0 + 4) * (w - 60) / (x1 - x0 + 4) + 60, 96, (innerWidth > 1000 ? 0.3 : 0.14) * innerHeight).toFixed(0) + 'px';
      if (this.resizeTo(wanted)) return;
      const [left, below] = [44, 30];
      this.scale = Math.min((w - left - 16) / (x1 - x0 + 4), (h - below - 14) / (y1 - y0 + 4));
      this.center = [(x0 + x1) / 2, (y0 + y1) / 2];
      this.middle = [left + (w - left - 10) / 2, 8 + (h - below - 8) / 2];
    } else {
      // A straight course is a strip: no empty ground above and below.
      const most = (innerWidth > 1000 ? 0.37 : 0.2) * innerHeight;
      const wanted = clamp(w / CLOSE * (2 * sideways() + 7), Math.min(most, innerWidth > 1000 ? 170 : 120), most).toFixed(0) + 'px';
      if (this.resizeTo(wanted)) return;
      this.scale = w / this.metres;
      this.middle = [w / 2, h / 2];
    }
    this.follow(now);
    if (this.whole) this.drawGrid();
  }

  /** Sets the height; says whether that changes it, as then it is drawn again. */
  resizeTo(height) {
    if (this.svg.style.height === height) return false;
    this.svg.style.height = height;
    return this.svg.clientHeight !== this.h;
  }

  position() {
    const [x, y] = this.center, [a, b] = this.middle, s = this.scale;
    this.left = x - a / s;
    this.top = y + b / s;
    this.world.setAttribute('transform', `matrix(${s} 0 0 ${-s} ${(a - s * x).toFixed(3)} ${(b + s * y).toFixed(3)})`);
  }

  drawGrid() {
    const { w, h, scale, left, top } = this;
    this.grid.replaceChildren();
    this.numbers.replaceChildren();
    const rounds = (from, length, about) => ticks(from, from + length / scale, length / about);
    let path = '';
    for (const [value, text] of rounds(left, w, 90)) {
      const x = (value - left) * scale;
      path += `M${x.toFixed(1)} 0V${h}`;
      if (x > 56 && x < w - 62) drawn('text', { class: 'tick', x: x.toFixed(1), y: h - 6 }, this.numbers, text);
    }
    for (const [value, text] of rounds(top - h / scale, h, 60)) {
      const y = (top - value) * scale;
      path += `M0 ${y.toFixed(1)}H${w}`;
      if (y > 30 && y < h - 24) drawn('text', { class: 'tick begin', x: 5, y: (y + 4).toFixed(1) }, this.numbers, text);
    }
    drawn('path', { class: 'grid', d: path }, this.grid);
    drawn('text', { class: 'label end', x: w - 5, y: h - 6 }, this.numbers, 'X [m]');
    drawn('text', { class: 'label begin', x: 5, y: 14 }, this.numbers, 'Y [m]');
  }

  follow(time) {
    if (!this.scale) return;
    const { k, x, y, heading, steer } = poseAt(time);
    if (![x, y, heading, steer].every(Number.isFinite)) return;
    if (!this.whole) { this.center = [x, y]; }
    this.position();
    if (!this.whole) this.drawGrid();
    // As large as a thumb's nail on a map of kilometres.
    const least = this.whole ? Math.max(1, 20 / (car.length * this.scale)) : 1;
    this.car.group.setAttribute('transform', `translate(${x.toFixed(3)} ${y.toFixed(3)}) rotate(${(heading * 180 / Math.PI).toFixed(2)}) scale(${least.toFixed(3)})`);
    for (const wheel of this.car.front) wheel.setAttribute('transform', `rotate(${(steer * 180 / Math.PI).toFixed(2)})`);
    let path = '';
    for (let i = Math.max(0, Math.floor(k - 2 / car.step)); i <= k; i++) path += (path ? 'L' : 'M') + car.x[i].toFixed(2) + ' ' + car.y[i].toFixed(2);
    this.trail.setAttribute('d', path && path + `L${x.toFixed(2)} ${y.toFixed(2)}`);
  }

  timeAt(a, b) {
    const [x, y] = [this.left + a / this.scale, this.top - b / this.scale];
    let [best, nearest] = [NaN, Infinity];
    for (let k = 0; k < car.x.length; k++) {
      const away = (car.x[k] - x) ** 2 + (car.y[k] - y) ** 2;
      if (away < nearest) [best, nearest] = [FIRST + k * car.step, away];
    }
    return best;
  }
}

// --- The page ----------------------------------------------------------------------------------------------------------------

const button = element('button', { type: 'button', class: 'play', 'aria-label': 'Play', title: 'play or pause (space)' }, '▶');
const slider = element('input', { type: 'range', class: 'time', min: FIRST, max: LAST, step: STEP, 'aria-label': 'time' });
const clock = element('output', { class: 'clock' });
const pace = element('select', { 'aria-label': 'speed', title: 'speed of the replay' });
for (const it of [0.1, 0.25, 0.5, 1, 2, 5, 10]) pace.append(element('option', it === 1 ? { value: it, selected: '' } : { value: it }, `× ${it}`));
const zoom = element('select', { 'aria-label': 'shown time', title: 'how much of the time the plots show (+ and −)' }, element('option', { value: LAST - FIRST }, 'whole run'));
for (const it of [60, 30, 10, 5, 2, 1]) if (it < 0.8 * (LAST - FIRST)) zoom.append(element('option', { value: it }, `${it} s`));
button.addEventListener('click', () => play(!playing));
slider.addEventListener('input', () => { play(false); setTime(Number(slider.value)); });
pace.addEventListener('change', () => { speed = Number(pace.value); });
// The test alone, where the car drives on for long.
const [first, end] = [data.stages[0], data.stages.find((it) => it[1] === END)];
const test = first && end && end[0] - first[0] < 0.7 * (LAST - FIRST) ? [first[0] - 0.04 * (end[0] - first[0]), 1.08 * (end[0] - first[0])] : null;
if (test) zoom.firstElementChild.after(element('option', { value: 'test' }, 'the test'));
zoom.addEventListener('change', () => (zoom.value === 'test' ? setSpan(test[1], test[0]) : setSpan(Number(zoom.value))));

// What is judged by its window as a whole is violated at no time of it.
for (const check of data.checks) if (check.first === null) check.violated = [];

/** Stages of manoeuvres, faults and violated checks over the whole time, a line for each. */
function spanLines() {
  const lines = [];
  if (data.stages.length) {
    const ends = [...data.stages.slice(1).map((it) => it[0]), LAST];
    lines.push(['test', data.stages.map(([from, name], k) => ({ span: [from, ends[k]], kind: name === END ? 'rest' : 'stage', name }))]);
  }
  if (data.laps.length) lines.push(['laps', data.laps.map(({ name, span }) => ({ span, kind: 'stage', name }))]);
  for (const [name, spans] of Object.entries(data.faults)) lines.push(['fault ' + name, spans.map((span) => ({ span, kind: 'fault', name: 'fault ' + name }))]);
  for (const { name, passed, violated } of data.checks) if (!passed && violated.length) lines.push([name, violated.map((span) => ({ span, kind: 'violated', name: 'violated: ' + name }))]);
  return lines.slice(0, 8).map(([name, spans]) => {
    const bar = element('div', { class: 'spans' });
    for (const { span: [from, to], kind, name: what } of spans) {
      const [a, b] = [from, to].map((it) => 100 * (it - FIRST) / (LAST - FIRST));
      const it = element('span', { class: kind, style: `left:${a.toFixed(2)}%;width:max(2px,${(b - a).toFixed(2)}%)`, title: visible(what) });
      if (b - a > 8 && kind === 'stage') it.textContent = visible(what);
      bar.append(it);
    }
    drag(bar, (x) => FIRST + x / bar.clientWidth * (LAST - FIRST));
    return [element('span', { class: 'what', title: visible(name) }, visible(name)), bar];
  });
}

const deck = element('div', { class: 'deck' });
if (car) {
  const maps = element('div', { class: 'maps' });
  const [close, whole] = [new CarMap(false), new CarMap(true)];
  const buttons = element('span', { class: 'zoom' });
  for (const [text, factor, label] of [['+', 1 / 1.5, 'closer'], ['−', 1.5, 'farther']]) {
    const it = element('button', { type: 'button', 'aria-label': label, title: label }, text);
    it.addEventListener('click', () => close.zoom(factor));
    buttons.append(it);
  }
  maps.append(element('div', { class: 'frame' }, close.svg, buttons), element('div', { class: 'frame' }, whole.svg));
  deck.append(maps);
}
const readout = element('p', { class: 'readout' });
deck.append(element('div', { class: 'bar' }, button, slider, clock, pace, zoom));
const lines = spanLines();
if (lines.length) deck.append(element('div', { class: 'lines' }, ...lines.flat()));
deck.append(readout);
const words = 'Space plays, ← and → move the time (with Shift far), + and − show less or more of it. Drag in any plot.';
deck.append(element('p', { class: 'faint keys' }, words));
if (car && speeds[1] > speeds[0]) {
  const ramp = element('span', { class: 'ramp' });
  for (let k = 0; k < SPEEDS; k++) ramp.append(element('i', { class: 's' + k }));
  const kmh = (it) => `${(3.6 * it).toFixed(speeds[1] - speeds[0] < 3 ? 1 : 0)}`;
  deck.append(element('p', { class: 'faint legend' }, 'Way by speed: ' + kmh(speeds[0]) + ' ', ramp, ` ${kmh(speeds[1])} km/h`));
}
const touches = data.hits.map((it) => it[1]).sort((a, b) => a - b);
if (touches.length) {
  const moments = touches.slice(0, 4).map((it) => `${it.toFixed(2)} s`).join(', ') + (touches.length > 4 ? ' and later' : '');
  const all = CONES.length === 1 ? 'the cone' : `${touches.length} of ${CONES.length} cones`;
  deck.append(element('p', { class: 'hits' }, element('i', { class: 'dot' }), ` The car hits ${all}, at ${moments}.`));
}
followers.push((time) => {
  slider.value = time;
  clock.textContent = `${time.toFixed(digits)} s`;
  if (!car) return;
  const { x, y, heading, steer, speed: v } = poseAt(time);
  const degrees = (it) => (it * 180 / Math.PI).toFixed(1).replace('-', '−');
  const parts = [`X ${x.toFixed(1)} m`, `Y ${y.toFixed(1)} m`, `heading ${degrees(heading)}°`];
  if (car.steer) parts.push(`steer ${degrees(steer)}°`);
  if (car.speed) parts.push(`${v.toFixed(1)} m/s = ${(3.6 * v).toFixed(0)} km/h`);
  readout.textContent = parts.join(' · ').replace(/-/g, '−');
});

const panels = element('div', { class: 'panels' });
function panel(title, made, css) {
  if (!made.length) return;
  panels.append(element('h3', {}, title), element('div', { class: 'tiles ' + (css || '') }, ...made.map((it) => it.figure)));
}
/** A failed check that has nothing to draw. */
function failureTile({ name, that, found }) {
  const caption = element('figcaption', {}, element('b', {}, visible('FAILED ' + name)), element('span', { class: 'found' }, visible(found)));
  return { figure: element('figure', { class: 'tile failed text' }, caption, element('p', { class: 'that' }, element('code', {}, visible(that)))) };
}
panel('Failed checks', [...data.failures.map(failureTile), ...data.checks.filter((it) => !it.passed).map(checkChart)], 'one');
panel(data.tests.map(visible).join(', '), data.diagrams.map(diagramChart));
panel('Diagrams', data.xy.map(xyChart));
panel('Signals', data.plots.map(signalChart));
panel('Passed checks', data.checks.filter((it) => it.passed).map(checkChart));

root.append(deck, panels);
root.classList.add('live', ...(car ? [] : ['plain']));
for (const { place } of data.checks) document.querySelectorAll(`[data-check="${place}"]`).forEach((it) => { it.hidden = true; });

document.addEventListener('keydown', (event) => {
  const focus = document.activeElement;
  const own = root.contains(focus) && !['INPUT', 'SELECT'].includes(focus.tagName);
  const box = root.getBoundingClientRect();
  const inSight = box.bottom > 0 && box.top < innerHeight;
  if (!inSight || event.ctrlKey || event.metaKey || event.altKey || !(own || focus === document.body || focus === slider)) return;
  const far = event.shiftKey ? (LAST - FIRST) / 20 : Math.max(STEP, span / 200);
  const actions = {
    ' ': () => play(!playing), ArrowLeft: () => setTime(now - far), ArrowRight: () => setTime(now + far),
    Home: () => setTime(FIRST), End: () => setTime(LAST), '+': () => setSpan(span / 1.5), '=': () => setSpan(span / 1.5), '-': () => setSpan(span * 1.5),
  };
  const action = actions[event.key];
  if (!action) return;
  event.preventDefault();
  if (event.key.startsWith('Arrow')) play(false);
  action();
});

// A link may name the time: report.html#t=12.5.
const named = /^#t=([0-9.]+)$/.exec(location.hash);
const failedCheck = data.checks.find((it) => !it.passed);
const failed = failedCheck || (data.failures.length ? { first: touches.length ? touches[0] : null } : undefined);
const worst = failed && (failed.first ?? failed.at);
const stages = data.stages.filter((it) => it[1] !== END);
const opening = named ? Number(named[1]) : failed && worst !== null && worst !== undefined ? worst : stages.length ? stages[stages.length - 1][0] : FIRST;
setTime(opening);
if (test && !failedCheck && !named) { zoom.value = 'test'; setSpan(test[1], test[0]); }
})();
