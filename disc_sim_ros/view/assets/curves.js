// The curves below the picture: one SVG for each quantity, with a line at the time of the picture.
const SVG = 'http://www.w3.org/2000/svg';
const charts = [];

function svg(name, attributes, parent, content) {
  const node = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  if (content !== undefined) node.textContent = content;
  parent.append(node);
  return node;
}

// A curve with a dotted companion, which is the next one, has a logarithmic axis from 0.01 on.
const LEAST = 0.01;
const isLogarithmic = which => Boolean(page.labels[which][2]);

function range(which) {
  let low = Infinity, high = -Infinity;
  for (const track of tracks) {
    for (const curve of isLogarithmic(which) ? [track.curves[which], track.curves[which + 1]] : [track.curves[which]]) {
      for (const value of curve) if (value !== null) { low = Math.min(low, value); high = Math.max(high, value); }
    }
  }
  if (isLogarithmic(which)) return [LEAST, 10 ** Math.ceil(Math.log10(Math.max(high, 10 * LEAST)))];
  if (low > high) return [0, 1];
  const least = 0.02 * Math.max(1, Math.abs(high)), middle = (low + high) / 2;
  return high - low < least ? [middle - least / 2, middle + least / 2] : [low, high];
}

const multiples = (low, high, step) => {
  const values = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i++) values.push(i * step);
  return values;
};
const decades = (low, high) => {
  const values = [];
  for (let i = Math.round(Math.log10(low)); i <= Math.round(Math.log10(high)); i++) values.push(10 ** i);
  return values;
};

function line(t, values, x, y) {
  let path = '', pen = 'M';
  const stride = Math.max(1, Math.floor(t.length / 1500)), last = t.length - 1;
  for (let k = 0; k <= last; k = k === last ? last + 1 : Math.min(k + stride, last)) {
    if (values[k] === null) { pen = 'M'; continue; }
    path += `${pen}${x(t[k]).toFixed(1)} ${y(values[k]).toFixed(1)}`;
    pen = 'L';
  }
  return path;
}

function draw(chart, which, seek) {
  const box = chart.svg, wide = box.clientWidth || 330, tall = box.clientHeight || 120;
  box.replaceChildren();
  box.setAttribute('viewBox', `0 0 ${wide} ${tall}`);
  const [left, right, top, bottom] = [42, wide - 8, 8, tall - 20];
  const end = duration() || 1, [low, high] = range(which), step = roundStep(high - low, 3);
  const x = chart.x = time => left + (right - left) * time / end;
  const share = isLogarithmic(which)
    ? value => Math.log(Math.max(value, low) / low) / Math.log(high / low)
    : value => (value - low) / (high - low);
  const y = value => bottom - (bottom - top) * share(value);
  for (const value of isLogarithmic(which) ? decades(low, high) : multiples(low, high, step)) {
    svg('line', { x1: left, x2: right, y1: y(value), y2: y(value), class: 'axis' }, box);
    svg('text', { x: left - 5, y: y(value) + 4, 'text-anchor': 'end' }, box, +value.toPrecision(6));
  }
  const tick = roundStep(end, Math.max(2, Math.round(wide / 110)));
  for (let i = 0; i * tick <= end * 1.0001; i++) {
    svg('text', { x: x(i * tick), y: tall - 5, 'text-anchor': 'middle' }, box, `${+(i * tick).toPrecision(6)}${i * tick + tick > end ? ' s' : ''}`);
  }
  tracks.forEach((track, i) => {
    svg('path', { d: line(track.t, track.curves[which], x, y), class: 'curve', stroke: colourOf(i) }, box);
    if (isLogarithmic(which)) svg('path', { d: line(track.t, track.curves[which + 1], x, y), class: 'curve dotted', stroke: colourOf(i) }, box);
  });
  chart.line = svg('line', { y1: top, y2: bottom, class: 'now' }, box);
  chart.seek = event => {
    const share = (event.clientX - box.getBoundingClientRect().left - left) / (right - left);
    seek(end * Math.min(1, Math.max(0, share)));
  };
}

function makeCurves(seek) {
  page.labels.forEach(([name, unit, dotted], which) => {
    const figure = document.createElement('figure'), caption = document.createElement('figcaption');
    const label = document.createElement('span'), value = document.createElement('output');
    label.textContent = `${name}, ${unit}${dotted ? ` (${dotted})` : ''}`;
    caption.append(label, value);
    const box = document.createElementNS(SVG, 'svg');
    box.setAttribute('role', 'img');
    box.setAttribute('aria-label', `${name} over the time`);
    figure.append(caption, box);
    if (dotted) figure.className = 'first';
    element('curves').append(figure);
    const chart = { svg: box, value };
    charts.push(chart);
    box.addEventListener('pointerdown', event => { box.setPointerCapture(event.pointerId); chart.seek(event); });
    box.addEventListener('pointermove', event => { if (event.buttons) chart.seek(event); });
  });
  redrawCurves(seek);
}

const redrawCurves = seek => charts.forEach((chart, which) => draw(chart, which, seek));
const number = (value, digits = 2) => value === null ? '-' : value.toFixed(digits).replace('-', '\u2212');

function markTime(time, chosen) {
  if (!tracks.length) return;
  charts.forEach((chart, which) => {
    const x = chart.x(time);
    chart.line.setAttribute('x1', x);
    chart.line.setAttribute('x2', x);
    chart.value.textContent = number(curveAt(tracks[chosen], which, time));
  });
}
