// What a predictor knew while a throw flew: measured positions, predicted path, landing and ellipse.
const foretold = track => track.predictions;

// Return the place of the prediction that is valid at a time, -1 before the first.
function predictionAt({ t }, time) {
  if (!t.length || time < t[0]) return -1;
  const [k, f] = placeIn(t, time);
  return f === 1 ? Math.min(k + 1, t.length - 1) : k;
}

// Predicted landings and their ellipses enlarge the picture, but by no more than a quarter of it.
function extendByLandings(low, high) {
  const span = Math.max(...high.map((value, i) => value - low[i]), 1);
  const [least, most] = [low.map(value => value - span / 4), high.map(value => value + span / 4)];
  for (const { landing, ellipse } of tracks.map(foretold).filter(Boolean)) {
    landing.forEach((value, j) => {
      const i = j % 2, long = ellipse[3 * Math.floor(j / 2)];
      low[i] = Math.min(low[i], Math.max(least[i], value - long));
      high[i] = Math.max(high[i], Math.min(most[i], value + long));
    });
  }
}

function addPredictions(made, i) {
  const known = foretold(made.track);
  if (!known) return;
  const colour = css('--predicted'), add = mesh => { picture.scene.add(mesh); return mesh; };
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.Float32BufferAttribute(known.measured, 3));
  const dots = add(new THREE.Points(geometry, new THREE.PointsMaterial({ color: new THREE.Color(colourOf(i)), size: 3.5, sizeAttenuation: false })));
  const flat = (shape, opacity) => add(new THREE.Mesh(shape, new THREE.MeshBasicMaterial({
    color: new THREE.Color(colour), transparent: true, opacity, depthWrite: false, side: THREE.DoubleSide,
  })));
  const round = Array.from({ length: 96 }, (_, i) => [Math.cos(i * Math.PI / 48), Math.sin(i * Math.PI / 48), 0]).flat();
  const circle = new THREE.BufferGeometry();
  circle.setAttribute('position', new THREE.Float32BufferAttribute(round, 3));
  made.foretold = {
    dots,
    ellipse: flat(new THREE.CircleGeometry(1, 96), 0.22),
    edge: add(new THREE.LineLoop(circle, new THREE.LineBasicMaterial({ color: new THREE.Color(colour) }))),
    landing: flat(new THREE.RingGeometry(0.5, 1, 32), 1),
    path: add(new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshBasicMaterial({ color: new THREE.Color(colour) }))),
    shown: -1,
  };
}

// Place what is known at a time; that of other throws than the chosen one is hidden, except for the dots.
function posePredictions(made, i, time, chosen) {
  const parts = made.foretold;
  if (!parts) return;
  const known = foretold(made.track), k = predictionAt(known, time);
  let dots = 0;
  while (dots < known.measuredTime.length && known.measuredTime[dots] <= time) dots++;
  parts.dots.geometry.setDrawRange(0, dots);
  const visible = i === chosen && k >= 0, { span } = picture.bounds;
  for (const name of ['ellipse', 'edge', 'landing', 'path']) parts[name].visible = visible;
  if (!visible) return;
  const [x, y] = known.landing.slice(2 * k, 2 * k + 2), [long, short, yaw] = known.ellipse.slice(3 * k, 3 * k + 3);
  for (const [name, height] of [['ellipse', 1e-4], ['edge', 1.5e-4]]) {
    parts[name].position.set(x, y, height * span);
    parts[name].scale.set(long, short, 1);
    parts[name].rotation.z = yaw;
  }
  parts.landing.position.set(x, y, 2e-4 * span);
  parts.landing.scale.setScalar(0.008 * span);
  const radius = 0.0012 * span, key = `${k} ${radius}`;
  if (parts.shown === key) return;
  parts.shown = key;
  parts.path.geometry.dispose();
  parts.path.geometry = tubeThrough(known.paths[k], radius);
}

// A tube through points, straight between them.
function tubeThrough(values, radius) {
  const points = [];
  for (let i = 0; i + 2 < values.length; i += 3) points.push(new THREE.Vector3(values[i], values[i + 1], values[i + 2]));
  if (points.length < 2) return new THREE.BufferGeometry();
  return new THREE.TubeGeometry(new THREE.CatmullRomCurve3(points), 48, radius, 5, false);
}

function explainPredictions() {
  if (!tracks.some(foretold)) return;
  const legend = element('legend');
  legend.hidden = false;
  for (const [kind, name, words] of [
    ['', 'Dots', 'measured positions until this time.'],
    ['', 'Grey line and disc', 'the flight fitted to all measurements.'],
    ['predicted', 'Orange', 'predicted at this time from the measurements until then: path, landing, and the ellipse that holds 90 % of such landings.'],
    ['', 'Miss', 'distance of the predicted landing from that of the last prediction.'],
  ]) {
    const label = document.createElement('b');
    label.className = kind;
    label.textContent = `${name}: `;
    legend.append(label, `${words} `);
  }
}
