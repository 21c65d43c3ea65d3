// The flights, and their interpolation: position and spin angle linear, attitude on the sphere.
// The attitude is that of the despun frame, so that any spin rate is right between two samples.
const page = JSON.parse(document.getElementById('flights').textContent);
const tracks = page.tracks;
const element = id => document.getElementById(id);
const colourOf = i => page.colours[i % page.colours.length];
const endOf = track => track.t.length ? track.t[track.t.length - 1] : 0;
const duration = () => Math.max(0, ...tracks.map(endOf));

// Return the sample before a time, and how far the time lies towards the next one, 0 to 1.
function placeIn(t, time) {
  let low = 0, high = t.length - 1;
  if (high < 1 || time <= t[0]) return [0, 0];
  if (time >= t[high]) return [high - 1, 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (t[middle] <= time) low = middle; else high = middle;
  }
  return [low, (time - t[low]) / (t[high] - t[low])];
}

const mixed = (a, b, f) => a === b || f === 0 ? a : f === 1 ? b : a + (b - a) * f;

function vectorAt(values, k, f) {
  const last = values.length / 3 - 1, next = Math.min(k + 1, last);
  return [0, 1, 2].map(i => mixed(values[3 * k + i], values[3 * next + i], f));
}

function slerp(a, b, f) {
  let dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
  const sign = dot < 0 ? -1 : 1;
  dot = Math.min(1, dot * sign);
  const angle = Math.acos(dot), sine = Math.sin(angle);
  const [x, y] = sine < 1e-6 ? [1 - f, f] : [Math.sin((1 - f) * angle) / sine, Math.sin(f * angle) / sine];
  const mix = a.map((value, i) => x * value + y * sign * b[i]);
  const length = Math.hypot(...mix);
  return mix.map(value => value / length);
}

// Return the attitude of the plastic: the despun one, then the spin about its z axis.
function spun([x, y, z, w], angle) {
  const s = Math.sin(angle / 2), c = Math.cos(angle / 2);
  return [x * c + y * s, y * c - x * s, z * c + w * s, w * c - z * s];
}

function poseAt(track, time) {
  const [k, f] = placeIn(track.t, time);
  const next = Math.min(k + 1, track.t.length - 1);
  const quaternion = j => track.attitude.slice(4 * j, 4 * j + 4);
  const spin = mixed(track.spin[k], track.spin[next], f);
  return {
    position: vectorAt(track.position, k, f),
    attitude: spun(slerp(quaternion(k), quaternion(next), f), spin),
    wind: track.wind ? vectorAt(track.wind, k, f) : null,
  };
}

function curveAt(track, which, time) {
  const [k, f] = placeIn(track.t, time), values = track.curves[which];
  const a = values[k], b = values[Math.min(k + 1, values.length - 1)];
  return a === null || b === null ? null : mixed(a, b, f);
}

// Return round steps of an axis: 1, 2 or 5 times a power of ten, about `count` over `span`.
function roundStep(span, count) {
  const raw = Math.max(span, 1e-9) / count, power = 10 ** Math.floor(Math.log10(raw));
  return power * [1, 2, 5, 10].find(factor => factor * power >= raw * 0.999);
}
