// The camera: around a target, which is the chosen disc or the middle of the field.
const eye = { mode: 'follow', azimuth: 0, elevation: 0, distance: 1, target: [0, 0, 0] };
const LIMIT = 1.55; // rad: not quite upright, where left and right have no meaning

function heading() {
  if (page.live || !tracks.length) return 0;
  const { position } = tracks[chosen], n = position.length;
  return Math.atan2(position[n - 2] - position[1], position[n - 3] - position[0]);
}

function aim(mode) {
  eye.mode = mode;
  const { low, high } = picture.bounds, camera = picture.camera;
  if (mode === 'follow') {
    eye.azimuth = heading() + Math.PI + 0.65;
    eye.elevation = 0.42;
    eye.distance = 6.5 * Math.max(1, ...tracks.map(shownDiameter));
    if (camera.aspect < 1) eye.distance /= Math.max(0.6, camera.aspect);
    return;
  }
  eye.target = low.map((value, i) => (value + high[i]) / 2);
  eye.azimuth = -Math.PI / 2;
  eye.elevation = mode === 'top' ? LIMIT : 0.3;
  const half = low.map((value, i) => (high[i] - value) / 2 + picture.bounds.span * 0.03);
  const up = Math.tan(picture.fov / 2 * Math.PI / 180), across = up * camera.aspect;
  const tall = mode === 'top' ? half[1] : half[2] + half[1] * Math.sin(eye.elevation);
  eye.distance = Math.max(half[0] / across, tall / up) + (mode === 'top' ? half[2] : half[1]);
}

function look() {
  if (eye.mode === 'follow' && picture.discs.length) eye.target = picture.discs[chosen].body.position.toArray();
  const { camera } = picture, flat = eye.distance * Math.cos(eye.elevation);
  camera.position.set(
    eye.target[0] + flat * Math.cos(eye.azimuth),
    eye.target[1] + flat * Math.sin(eye.azimuth),
    eye.target[2] + eye.distance * Math.sin(eye.elevation),
  );
  if (picture.bounds.low[2] > -1e-3) camera.position.z = Math.max(camera.position.z, 0.02 * eye.distance);
  camera.near = eye.distance / 100;
  camera.far = 100 * picture.bounds.span + 10 * eye.distance;
  camera.updateProjectionMatrix();
  camera.lookAt(...eye.target);
}

function fit() {
  const wide = view.clientWidth, high = view.clientHeight;
  renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
  renderer.setSize(wide, high, false);
  picture.camera.aspect = wide / high;
  aim(eye.mode);
}

function steer(canvas, changed) {
  const fingers = new Map();
  const apart = () => { const [a, b] = [...fingers.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
  const zoom = factor => { eye.distance = Math.min(1e4, Math.max(0.2, eye.distance * factor)); changed(); };
  canvas.addEventListener('pointerdown', event => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  for (const kind of ['pointerup', 'pointercancel']) canvas.addEventListener(kind, event => fingers.delete(event.pointerId));
  canvas.addEventListener('pointermove', event => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const width = fingers.size === 2 ? apart() : 0;
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    if (fingers.size === 2) return zoom(width / Math.max(1, apart()));
    eye.azimuth -= 0.007 * (event.clientX - before[0]);
    eye.elevation = Math.min(LIMIT, Math.max(-0.3, eye.elevation + 0.007 * (event.clientY - before[1])));
    changed();
  });
  canvas.addEventListener('wheel', event => { event.preventDefault(); zoom(Math.exp(0.001 * event.deltaY)); }, { passive: false });
}
