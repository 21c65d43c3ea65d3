// The clock, the buttons and the loop that draws.
let chosen = 0, time = 0, playing = false, speed = 1, before = null, stale = true;

function write() {
  const end = duration();
  element('time').value = end ? time / end : 0;
  element('clock').value = `${time.toFixed(2)} / ${end.toFixed(2)} s`;
  if (!tracks.length || !tracks[chosen].t.length) {
    element('now').textContent = 'waiting for a disc';
    return;
  }
  markTime(time, chosen);
  const wind = picture.ready && tracks[chosen].wind ? poseAt(tracks[chosen], time).wind : null;
  const row = ([name, unit], which) => `${number(curveAt(tracks[chosen], which, time))} ${unit}  ${name}`;
  const rows = page.labels.map(row).filter((_, which) => which < 4 || which > 5); // pitch and roll are in the curves only
  if (wind) rows.push(`${number(Math.hypot(...wind) / page.metresPerSecondPerSpeed)} ${page.units.speed}  wind`);
  element('now').textContent = rows.join('\n');
}

function frame(now) {
  requestAnimationFrame(frame);
  if (page.live) {
    const was = time;
    if (playing && tracks.length) time = liveTime(time, before === null ? 0 : (now - before) / 1000);
    redrawLive(now);
    stale ||= time !== was;
  } else if (playing) {
    time = Math.min(duration(), time + (before === null ? 0 : speed * (now - before) / 1000));
    if (time >= duration()) play(false);
    stale = true;
  }
  before = now;
  if (!stale) return;
  stale = false;
  write();
  if (!picture.ready || picture.discs.some(made => !made.track.t.length) || (page.live && !tracks.length)) return;
  pose(time, chosen, page.live && playing ? endOf(tracks[chosen]) - time : null);
  look();
  renderer.render(picture.scene, picture.camera);
}

function play(on) {
  if (on && !page.live && time >= duration()) time = 0;
  playing = on;
  before = null;
  element('play').textContent = on ? 'Pause' : page.live ? 'Live' : 'Play';
  stale = true;
}

function seek(to) {
  if (page.live && playing) play(false);
  time = Math.min(duration(), Math.max(0, to));
  stale = true;
}

function choose(i) {
  chosen = i;
  [...element('flights-list').children].forEach((row, j) => row.firstChild.setAttribute('aria-pressed', i === j));
  if (picture.ready && eye.mode === 'follow') aim('follow');
  stale = true;
}

function paint(theme) {
  document.documentElement.dataset.theme = theme;
  element('theme').textContent = theme === 'dark' ? 'Light' : 'Dark';
  if (picture.ready) build();
  stale = true;
}

function listFlights() {
  element('flights-list').replaceChildren();
  tracks.forEach((track, i) => {
    const row = document.createElement('li'), button = document.createElement('button');
    button.type = 'button';
    const parts = [['i', ''], ['b', track.name], ['span', track.result]].map(([kind, words]) => {
      const part = document.createElement(kind);
      part.textContent = words;
      return part;
    });
    parts[0].style.background = colourOf(i);
    button.append(...parts);
    button.addEventListener('click', () => choose(i));
    row.append(button);
    element('flights-list').append(row);
  });
  choose(chosen);
}

function setCamera(mode) {
  element('camera').value = mode;
  if (picture.ready) aim(mode);
  stale = true;
}

function setSize(times) {
  element('size').value = times;
  picture.size = +times;
  if (picture.ready && eye.mode === 'follow') aim('follow');
  stale = true;
}

function connect() {
  element('title').textContent = page.title;
  element('play').addEventListener('click', () => play(!playing));
  element('time').addEventListener('input', event => seek(event.target.value * duration()));
  element('speed').addEventListener('change', event => { speed = +event.target.value; });
  element('camera').addEventListener('change', event => setCamera(event.target.value));
  element('size').addEventListener('change', event => setSize(event.target.value));
  element('theme').addEventListener('click', () => paint(document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark'));
  window.addEventListener('resize', () => { redrawCurves(seek); if (picture.ready) fit(); stale = true; });
  document.addEventListener('keydown', event => {
    if (/^(INPUT|SELECT|BUTTON)$/.test(event.target.tagName)) return;
    const step = { ArrowLeft: -0.05, ArrowRight: 0.05 }[event.key];
    if (event.key === ' ') play(!playing); else if (step) seek(time + step); else return;
    event.preventDefault();
  });
}

function start() {
  takeOver();
  build();
  fit();
  steer(renderer.domElement, () => { stale = true; });
  picture.ready = true;
  setCamera(page.camera);
  if (page.live || !matchMedia('(prefers-reduced-motion: reduce)').matches) play(true);
}

// The viewer of trimesh loads its parts a moment after the page; without WebGL it never does.
function wait() {
  if (!isThere()) {
    const words = document.createElement('p');
    words.textContent = 'This browser has no WebGL: the curves below show the flight.';
    view.append(words);
  } else if (typeof controls !== 'undefined' && controls) start();
  else setTimeout(wait, 20);
}

paint(matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light');
listFlights();
explainPredictions();
connect();
makeCurves(seek);
if (page.live) {
  throwPanel();
  connectLive();
}
requestAnimationFrame(frame);
wait();

// For tests and recordings: the picture at any time, and where it shows a disc.
window.discView = {
  get flights() { return tracks.map(track => [track.name, track.t.length, track.flight]); },
  get ready() { return picture.ready; },
  get time() { return time; },
  get playing() { return playing; },
  // Press the button of a live view; return the answer to the last time.
  throws() { document.querySelector('#throw button').click(); return document.querySelector('#throw > output').textContent; },
  duration, seek, play, choose, setCamera, setSize, paint,
  pose: (i = 0) => poseAt(tracks[i], time),
  // What is drawn of the predictions of a flight: number of dots, place of the landing, half axes of the ellipse.
  foretold(i = 0) {
    const { dots, landing, edge } = picture.discs[i].foretold;
    return { dots: dots.geometry.drawRange.count, visible: landing.visible, landing: landing.position.toArray().slice(0, 2), axes: edge.scale.toArray().slice(0, 2), yaw: edge.rotation.z };
  },
  pixel(i = 0) {
    const at = picture.discs[i].body.position.clone().project(picture.camera), box = renderer.domElement.getBoundingClientRect();
    return [box.left + (at.x + 1) / 2 * box.width, box.top + (1 - at.y) / 2 * box.height];
  },
};
