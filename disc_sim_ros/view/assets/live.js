// The page of a running simulator: states come over a WebSocket, and a button throws.
const live = { flights: new Map(), drawn: 0, landing: null, socket: null };
const SAMPLES = 20000; // of one flight; older ones are dropped
const DELAY = 0.12; // s behind the newest state at most, to move evenly between two states

function freshTrack(state) {
  return {
    name: state.name, result: '', diameter: state.diameter, landed: false, wind: null, flight: state.flight,
    t: [], position: [], attitude: [], spin: [], curves: page.labels.map(() => []),
  };
}

function append(track, state) {
  const last = endOf(track);
  if (track.t.length && state.t <= last) return;
  track.t.push(state.t);
  track.position.push(...state.position);
  track.attitude.push(...state.attitude);
  track.spin.push(state.spin);
  track.curves.forEach((curve, which) => curve.push(state.curves[which]));
  if (state.wind) (track.wind ||= []).push(...state.wind);
  if (track.wind && track.wind.length !== track.position.length) track.wind = null;
  if (track.t.length > SAMPLES) {
    track.t.splice(0, SAMPLES / 2);
    track.spin.splice(0, SAMPLES / 2);
    track.position.splice(0, 3 * SAMPLES / 2);
    track.attitude.splice(0, 4 * SAMPLES / 2);
    track.curves.forEach(curve => curve.splice(0, SAMPLES / 2));
    track.wind = null;
  }
}

// Take states: of a new disc, of a new flight of a disc, or further ones. Return true if the list of discs changed.
function receive(discs) {
  let listed = false;
  for (const [namespace, state] of Object.entries(discs)) {
    let i = live.flights.get(namespace);
    if (i === undefined) {
      live.flights.set(namespace, i = tracks.length);
      tracks.push(freshTrack(state));
      listed = true;
    } else if (tracks[i].flight !== state.flight) {
      listed ||= tracks[i].name !== state.name;
      tracks[i] = Object.assign(tracks[i], freshTrack(state));
      if (i === chosen) live.landing = null;
    } else if (tracks[i].name !== state.name) { // the configuration came after the first states
      Object.assign(tracks[i], { name: state.name, diameter: state.diameter });
      listed = true;
    }
    append(tracks[i], state);
    if (state.landing && i === chosen) live.landing = state.landing;
  }
  return listed;
}

const outside = (outer, inner) => [0, 1].some(i => inner.low[i] < outer.low[i] || inner.high[i] > outer.high[i]);

// Draw what has grown: the paths and curves, and the ground where a disc has left it.
function redrawLive(now) {
  if (now - live.drawn < 200 || !tracks.length) return;
  live.drawn = now;
  redrawCurves(seek);
  if (!picture.ready) return;
  if (picture.discs.length !== tracks.length || outside(picture.bounds, extent())) {
    build();
    if (eye.mode !== 'follow') aim(eye.mode);
  }
  else picture.discs.forEach(repath);
  if (!picture.spot) {
    picture.spot = new THREE.Mesh(new THREE.RingGeometry(0.35, 0.5, 40), new THREE.MeshBasicMaterial({ color: 0xd55e00, side: THREE.DoubleSide }));
  }
  if (live.landing) {
    picture.spot.position.set(live.landing[0], live.landing[1], 2e-4 * picture.bounds.span);
    picture.scene.add(picture.spot);
  } else picture.spot.removeFromParent();
}

// Return the time of the picture: a little behind the newest state, at the rate of the clock.
function liveTime(at, elapsed) {
  const end = endOf(tracks[chosen]);
  return Math.min(end, Math.max(end - DELAY, at + elapsed));
}

function throwPanel() {
  const form = document.createElement('form'), answer = document.createElement('output');
  form.id = 'throw';
  const inputs = page.live.sliders.map(slider => {
    const label = document.createElement('label'), input = document.createElement('input'), value = document.createElement('output');
    Object.assign(input, { type: 'range', name: slider.name, min: slider.low, max: slider.high, step: slider.step, value: slider.value });
    const show = () => { value.textContent = `${input.value.replace('-', '\u2212')} ${slider.unit}`; };
    input.addEventListener('input', show);
    show();
    label.append(slider.name, input, value);
    form.append(label);
    return input;
  });
  const button = document.createElement('button');
  button.textContent = 'Throw';
  form.append(button, answer);
  form.addEventListener('submit', event => {
    event.preventDefault();
    const launch = Object.fromEntries(inputs.map(input => [input.name, +input.value]));
    const disc = [...live.flights].find(([, i]) => i === chosen)?.[0] ?? '';
    if (live.socket?.readyState !== 1) { answer.textContent = 'not connected'; return; }
    live.socket.send(JSON.stringify({ ...launch, disc, token: location.hash.slice(1) }));
    play(true);
  });
  element('flights-list').before(form);
  live.say = words => { answer.textContent = words; };
}

function connectLive() {
  const socket = live.socket = new WebSocket(`ws://${location.host}/live`);
  socket.addEventListener('message', event => {
    const message = JSON.parse(event.data);
    if (message.answer) live.say(message.answer);
    if (message.discs && receive(message.discs)) listFlights();
    stale = true;
  });
  socket.addEventListener('close', () => { live.say('live_view has ended or was restarted: waiting for it'); setTimeout(connectLive, 1000); });
  socket.addEventListener('open', () => live.say(''));
}
