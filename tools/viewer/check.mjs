// Opens a bag with the layout in a browser, as a user would, takes pictures, and checks the panels.

import { readFileSync } from 'node:fs';
import { mkdir, mkdtemp, rm } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import path from 'node:path';
import { parseArgs } from 'node:util';

import { OPTIONS, UserError, run, serve } from './serve.mjs';

const USAGE = `usage: node check.mjs [options] BAG

Opens BAG (a folder or an .mcap file) with the layout in a viewer, in a browser without a window.
Takes a picture after opening, without any click, and one at each time; lets it play, and compares.
Ends with 1 if a panel stays empty, or does not move with the time where it should.

  --at F,F,...      fractions of the bag to take pictures at, 0 to 1 (default 0.3,0.6,1)
  --out FOLDER      for the pictures (default pictures)
  --layout FILE     (default config/foxglove_layout.json)
  --size WxH        of the window in pixels (default 1600x1000)
  --colours SCHEME  light or dark (default light)
  --browser FILE    Chromium (default /usr/bin/chromium)
  --modules FOLDER  where the viewer is installed (default node_modules beside this file)
  --web FOLDER      use the Lichtblick for the web in this folder instead (its index.html is there)`;
const BROWSER_FLAGS = [
  '--headless=new',
  '--no-sandbox',
  '--use-angle=swiftshader',
  '--enable-unsafe-swiftshader',
  '--ignore-gpu-blocklist',
  '--disable-quic',
  '--no-first-run',
  '--disable-background-networking',
  '--disable-component-update',
  '--disable-sync',
];
const LOAD = 60_000; // ms to wait for the viewer and the bag
const SETTLE = 2_000; // ms that drawing may take, on a machine without a graphics card
const LATEST = 0.98; // of the bag, for a click into the time line
const FRAMES = 5; // pictures of the playing disc
const STEP = 120; // ms of playing between them
const ENOUGH = 150; // coloured pixels of a panel that shows something
const MOVING = 0.001; // of the pixels of a panel that differ between two times
const STILL = /^Plot/; // plots show the whole flight at all times; only a line moves in them

let options;
let panels; // ids of the layout
let close; // id of the panel that follows the disc; a layout may have none

await run(async () => {
  options = given();
  if (!options) {
    console.log(USAGE);
    return 0;
  }
  const { server, recording, layout, address } = await serve(options);
  const { configById } = JSON.parse(readFileSync(layout, 'utf8'));
  panels = Object.keys(configById);
  close = panels.find((id) => configById[id].followTf === 'disc');
  const profile = await mkdtemp(path.join(tmpdir(), 'viewer-'));
  try {
    const well = report(path.basename(recording), await look(address, profile));
    return well ? 0 : 1;
  } finally {
    server.close();
    server.closeAllConnections();
    await rm(profile, { recursive: true, force: true });
  }
});

/** Open the address, take all pictures; return the pixels of each panel in them. */
async function look(address, profile) {
  const { chromium } = createRequire(path.join(options.modules, 'x.js'))('playwright-core');
  const browser = await chromium.launchPersistentContext(profile, {
    executablePath: options.browser,
    viewport: options.size,
    args: BROWSER_FLAGS,
  });
  try {
    const page = browser.pages()[0];
    const errors = [];
    page.on('pageerror', (error) => errors.push(String(error)));
    await mkdir(options.out, { recursive: true });
    await page.goto(address);
    await loaded(page);
    const seen = { opened: await picture(page, 'opened') };
    for (const fraction of options.at) {
      await seek(page, fraction);
      seen[`at ${fraction}`] = await picture(page, `at_${fraction}`);
    }
    return { seen, frames: close ? await play(page) : [], errors };
  } finally {
    await browser.close();
  }
}

/** Wait until all panels show something: the plots once they have the whole bag. */
async function loaded(page) {
  for (const id of panels) await panel(page, id).waitFor({ timeout: LOAD });
  const deadline = Date.now() + LOAD;
  for (const id of panels) {
    while (Date.now() < deadline && coloured(await pixels(page, id)) < ENOUGH) {
      await page.waitForTimeout(SETTLE / 10);
    }
  }
}

function panel(page, name) {
  return page.locator(`[data-testid="panel-mouseenter-container ${name}"]`);
}

/** Go to a time: click into the time line at the bottom, and play what is left to the end. */
async function seek(page, fraction) {
  const box = await page.locator('[class*=Slider-root]').boundingBox();
  const shown = Math.min(fraction, LATEST);
  await page.mouse.click(box.x + shown * box.width, box.y + box.height / 2);
  await page.mouse.move(box.x + box.width / 2, box.y + box.height + 20);
  await page.waitForTimeout(SETTLE);
  if (fraction < 1) return;
  await page.keyboard.press('Space');
  await page.locator('button[title=Play]').waitFor({ timeout: LOAD });
  await page.waitForTimeout(SETTLE);
}

/** Save a picture of the window; return what each panel shows. */
async function picture(page, name) {
  await page.screenshot({ path: path.join(options.out, `${name}.png`) });
  const shown = {};
  for (const id of panels) shown[id] = await pixels(page, id);
  return shown;
}

/** Return the pixels of a panel, as the browser decodes its picture. */
async function pixels(page, id) {
  const image = (await panel(page, id).screenshot()).toString('base64');
  return page.evaluate(async (data) => {
    const blob = await (await fetch(`data:image/png;base64,${data}`)).blob();
    const bitmap = await createImageBitmap(blob);
    const canvas = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
    canvas.drawImage(bitmap, 0, 0);
    const rgba = canvas.getImageData(0, 0, bitmap.width, bitmap.height).data;
    const found = new Array(rgba.length / 4);
    for (let i = 0; i < found.length; i += 1) {
      found[i] = rgba[4 * i] * 65536 + rgba[4 * i + 1] * 256 + rgba[4 * i + 2];
    }
    return found;
  }, image);
}

/** Let the bag play, and stop it for each picture of the disc; return those. */
async function play(page) {
  await seek(page, 0.2);
  const frames = [await pixels(page, close)];
  while (frames.length < FRAMES) {
    await page.keyboard.press('Space');
    await page.waitForTimeout(STEP);
    await page.keyboard.press('Space');
    await page.waitForTimeout(SETTLE / 4);
    frames.push(await pixels(page, close));
  }
  return frames;
}

/** Count the pixels with a strong colour, which no background or text has. */
function coloured(shown) {
  return shown.filter((p) => {
    const rgb = [p >> 16, (p >> 8) & 255, p & 255];
    return Math.max(...rgb) - Math.min(...rgb) > 60;
  }).length;
}

function difference(a, b) {
  return a.filter((p, i) => p !== b[i]).length / a.length;
}

/** Print what the panels showed; return true if all panels are filled. */
function report(name, { seen, frames, errors }) {
  const times = Object.keys(seen);
  const lines = panels.map((id) => {
    const counts = times.map((time) => coloured(seen[time][id]));
    const moves = Math.max(...times.map((time) => difference(seen.opened[id], seen[time][id])));
    const good = Math.min(...counts) >= ENOUGH && (STILL.test(id) || moves >= MOVING);
    return [good, `${id}: ${counts.join(', ')} coloured pixels, ${percent(moves)} moves`];
  });
  if (frames.length) {
    const turns = frames.slice(1).map((frame, i) => difference(frames[i], frame));
    const text = `${close} while it plays: ${turns.map(percent).join(', ')} moves`;
    lines.push([Math.min(...turns) >= MOVING, text]);
  }
  lines.push(...errors.map((error) => [false, error]));
  console.log(`${name}: ${times.join(', ')}`);
  for (const [good, line] of lines) console.log(`  ${good ? 'ok ' : 'BAD'} ${line}`);
  console.log(`pictures in ${options.out}`);
  return lines.every(([good]) => good);
}

function percent(part) {
  return `${(100 * part).toFixed(1)} %`;
}

/** Return the arguments, or nothing where help is wanted. */
function given() {
  const { values, positionals } = parseArgs({
    allowPositionals: true,
    options: {
      ...OPTIONS,
      at: { type: 'string', default: '0.3,0.6,1' },
      out: { type: 'string', default: 'pictures' },
      size: { type: 'string', default: '1600x1000' },
      browser: { type: 'string', default: '/usr/bin/chromium' },
    },
  });
  if (values.help) return undefined;
  if (positionals.length !== 1) throw new UserError(USAGE);
  const [width, height] = values.size.split('x').map(Number);
  if (!(width > 0 && height > 0)) throw new UserError(`--size ${values.size}: such as 1600x1000`);
  const at = values.at.split(',').map(Number);
  if (!at.every((fraction) => fraction >= 0 && fraction <= 1)) {
    throw new UserError(`--at ${values.at}: fractions from 0 to 1, with commas`);
  }
  const modules = path.resolve(values.modules);
  return { ...values, modules, at, bag: positionals[0], size: { width, height } };
}
