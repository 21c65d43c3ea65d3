// The picture: the parts of the disc come from the page of trimesh, with its three.js and renderer.
const view = element('view');
const picture = { ready: false, discs: [], size: 0, fov: 40 };
const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const isThere = () => typeof THREE !== 'undefined' && typeof renderer !== 'undefined' && renderer;

function extent() {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (const { position } of tracks) {
    position.forEach((value, i) => {
      low[i % 3] = Math.min(low[i % 3], value);
      high[i % 3] = Math.max(high[i % 3], value);
    });
  }
  extendByLandings(low, high);
  if (page.live) [[-3, 30], [-8, 8], [0, 5]].forEach(([a, b], i) => { low[i] = Math.min(low[i], a); high[i] = Math.max(high[i], b); });
  low[2] = Math.min(low[2], 0);
  return { low, high, span: Math.max(...high.map((value, i) => value - low[i]), 1) };
}

function text(words, colour) {
  const canvas = document.createElement('canvas'), pen = canvas.getContext('2d');
  const font = '600 40px system-ui, Arial, sans-serif';
  pen.font = font;
  canvas.width = Math.ceil(pen.measureText(words).width) + 12;
  canvas.height = 52;
  pen.font = font;
  pen.fillStyle = colour;
  pen.textBaseline = 'middle';
  pen.fillText(words, 6, 27);
  const map = new THREE.CanvasTexture(canvas);
  map.encoding = THREE.sRGBEncoding;
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map, sizeAttenuation: false, fog: false }));
  sprite.scale.set(0.036 * canvas.width / canvas.height, 0.036, 1);
  return sprite;
}

function lines(points, colour) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.Float32BufferAttribute(points, 3));
  return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: new THREE.Color(colour) }));
}

// The ground: lines at round distances with numbers, finer lines between them.
function ground({ low, high, span }) {
  const group = new THREE.Group(), metres = page.metresPerLength;
  const step = roundStep(span / metres, 5) * metres;
  const edge = (value, side) => Math[side < 0 ? 'floor' : 'ceil'](value / step) * step + side * step;
  const [x0, x1, y0, y1] = [edge(low[0], -1), edge(high[0], 1), edge(low[1], -1), edge(high[1], 1)];
  const grid = spacing => {
    const points = [];
    for (let i = Math.round(x0 / spacing); i <= Math.round(x1 / spacing); i++) points.push(i * spacing, y0, 0, i * spacing, y1, 0);
    for (let i = Math.round(y0 / spacing); i <= Math.round(y1 / spacing); i++) points.push(x0, i * spacing, 0, x1, i * spacing, 0);
    return points;
  };
  group.add(lines(grid(step / 10), css('--minor')), lines(grid(step), css('--grid')));
  for (let i = Math.round(x0 / step); i <= Math.round(x1 / step); i++) {
    const label = text(`${+(i * step / metres).toPrecision(6)} ${page.units.length}`, css('--soft'));
    label.position.set(i * step, Math.min(low[1], 0) - 0.35 * step, 0.02 * step);
    group.add(label);
  }
  if (low[2] > -1e-3) {
    const material = new THREE.MeshBasicMaterial({ color: new THREE.Color(css('--ground')), polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 2 });
    const plane = new THREE.Mesh(new THREE.CircleGeometry(40 * span, 48), material);
    plane.position.set((x0 + x1) / 2, (y0 + y1) / 2, -2e-4 * span);
    group.add(plane);
  }
  return group;
}

// The path as a tube whose parameter is the time, so that its drawn part ends at the disc.
function tube(track, colour, radius) {
  class Path extends THREE.Curve {
    getPoint(u) { return new THREE.Vector3(...poseAt(track, track.t[0] + u * (endOf(track) - track.t[0])).position); }
    getPointAt(u) { return this.getPoint(u); }
    getTangentAt(u) { return this.getTangent(u); }
  }
  const segments = Math.ceil(Math.min(400, Math.max(8, track.t.length), Math.max(24, 12000 / tracks.length))), around = 6;
  const mesh = new THREE.Mesh(
    new THREE.TubeGeometry(new Path(), segments, radius, around, false),
    new THREE.MeshBasicMaterial({ color: new THREE.Color(colour) }),
  );
  mesh.userData = { segments, around, start: track.t[0], end: endOf(track) };
  return mesh;
}

function disc(track, i, parts) {
  const body = new THREE.Group(), colour = new THREE.Color(colourOf(i)).convertSRGBToLinear();
  for (const [name, mesh] of Object.entries(parts)) {
    const copy = mesh.clone();
    copy.material = mesh.material.clone();
    if (name === 'coloured') copy.material.color = colour;
    body.add(copy);
  }
  const shadow = new THREE.Mesh(
    new THREE.CircleGeometry(0.5, 32),
    new THREE.MeshBasicMaterial({ color: 0x000000, transparent: true, opacity: 0.35, depthWrite: false }),
  );
  const plumb = lines([0, 0, 0, 0, 0, 1], css('--soft'));
  return { track, body, shadow, plumb };
}

function arrow() {
  const group = new THREE.Group(), colour = new THREE.MeshBasicMaterial({ color: 0xe69f00 });
  const shaft = new THREE.Mesh(new THREE.CylinderGeometry(0.03, 0.03, 0.75, 10), colour);
  const head = new THREE.Mesh(new THREE.ConeGeometry(0.09, 0.25, 16), colour);
  shaft.position.y = 0.375;
  head.position.y = 0.875;
  group.add(shaft, head);
  return group;
}

// Take over from the page of trimesh: its renderer and the parts of the disc, without its controls.
function takeOver() {
  controls.dispose();
  window.removeEventListener('resize', onWindowResize);
  animate = () => {};
  const parts = {};
  scene.traverse(node => { if (node.isMesh) parts[node.material.name] = node; });
  view.prepend(renderer.domElement);
  renderer.outputEncoding = THREE.sRGBEncoding;
  picture.parts = parts;
  picture.camera = new THREE.PerspectiveCamera(picture.fov, 1, 0.05, 1e5);
  picture.camera.up.set(0, 0, 1);
}

// Make the paths of a disc anew: thin ones for the near camera, thick ones for the far ones.
function repath(made, i) {
  for (const path of made.paths || []) for (const mesh of [path.flown, path.rest]) { mesh.removeFromParent(); mesh.geometry.dispose(); mesh.material.dispose(); }
  const thick = 0.0016 * picture.bounds.span, linear = mesh => { mesh.material.color.convertSRGBToLinear(); return mesh; };
  made.paths = made.track.t.length < 2 ? [] : [Math.min(0.03, thick), thick].map(radius => ({
    flown: linear(tube(made.track, colourOf(i), radius)), rest: linear(tube(made.track, css('--soft'), 0.35 * radius)),
  }));
  for (const path of made.paths) picture.scene.add(path.flown, path.rest);
}

function build() {
  const all = picture.scene = new THREE.Scene();
  const bounds = picture.bounds = extent();
  all.background = new THREE.Color(css('--sky')); // three.js mixes it with colours of the screen
  all.fog = new THREE.Fog(all.background, 4 * bounds.span, 24 * bounds.span);
  all.add(new THREE.HemisphereLight(0xffffff, 0x8d968d, 0.75));
  const sun = new THREE.DirectionalLight(0xffffff, 0.55);
  sun.position.set(-0.4, -0.5, 1);
  all.add(sun, ground(bounds));
  picture.discs = tracks.map((track, i) => {
    const made = disc(track, i, picture.parts);
    all.add(made.body, made.shadow, made.plumb);
    return made;
  });
  picture.discs.forEach(addPredictions);
  picture.arrow = arrow();
  picture.arrow.visible = false;
  all.add(picture.arrow);
  const plain = new Set(); // materials whose colours were given as seen on the screen
  all.traverse(({ material }) => { if (material && (material.isLineBasicMaterial || material.isMeshBasicMaterial || material.isPointsMaterial)) plain.add(material); });
  plain.forEach(material => material.color.convertSRGBToLinear());
  picture.discs.forEach(repath);
}

// An enlarged disc is 4 times as large beside the camera, and large enough to be seen from afar.
function shownDiameter({ diameter }) {
  if (picture.size) return diameter * picture.size;
  return eye.mode === 'follow' ? 4 * diameter : Math.max(4 * diameter, 0.035 * picture.bounds.span);
}

// Place the discs. Those of a running simulator fly at times of their own, all equally late.
function pose(now, chosen, late) {
  picture.discs.forEach((made, i) => {
    const time = late === null ? now : Math.max(0, endOf(made.track) - late);
    const { position, attitude, wind } = poseAt(made.track, time);
    const wide = shownDiameter(made.track);
    made.body.position.set(...position);
    made.body.quaternion.set(...attitude);
    made.body.scale.setScalar(wide);
    made.shadow.position.set(position[0], position[1], 1e-4 * picture.bounds.span);
    made.shadow.scale.setScalar(wide);
    made.plumb.position.set(position[0], position[1], 0);
    made.plumb.scale.set(1, 1, position[2] || 1e-9);
    made.paths.forEach(({ flown, rest }, j) => {
      rest.visible = (j === 1) === (eye.mode !== 'follow') && late === null;
      flown.visible = (j === 1) === (eye.mode !== 'follow') && !made.foretold; // there, the dots show it
      const { segments, around, start, end } = flown.userData;
      const part = Math.min(1, Math.max(0, (time - start) / (end - start || 1)));
      flown.geometry.setDrawRange(0, Math.floor(part * segments) * around * 6);
    });
    posePredictions(made, i, time, chosen);
    if (i !== chosen) return;
    const speed = wind ? Math.hypot(...wind) : 0;
    picture.arrow.visible = speed > 1e-3;
    if (!picture.arrow.visible) return;
    const direction = new THREE.Vector3(...wind).normalize();
    picture.arrow.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), direction);
    const length = wide * Math.min(3, 0.8 + 0.15 * speed);
    picture.arrow.scale.set(wide, length, wide);
    picture.arrow.position.set(position[0], position[1], position[2] + 0.75 * wide).addScaledVector(direction, -length / 2);
  });
}
