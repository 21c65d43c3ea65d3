// The viewer, a bag and a layout behind one address: what `open` and `check` have in common.

import { createReadStream, existsSync, readFileSync, readdirSync, statSync } from 'node:fs';
import { createServer } from 'node:http';
import path from 'node:path';
import { fileURLToPath } from 'node:url';

const HERE = path.dirname(fileURLToPath(import.meta.url));
const MODULES = path.join(HERE, 'node_modules');
const LAYOUT = path.join(HERE, '../../config/foxglove_layout.json');
const KINDS = {
  '.html': 'text/html',
  '.js': 'text/javascript',
  '.json': 'application/json',
  '.png': 'image/png',
  '.svg': 'image/svg+xml',
  '.wasm': 'application/wasm',
};

/** Options that both commands take, for parseArgs. */
export const OPTIONS = {
  layout: { type: 'string', default: LAYOUT },
  colours: { type: 'string', default: 'light' },
  modules: { type: 'string', default: MODULES },
  web: { type: 'string' },
  help: { type: 'boolean', short: 'h' },
};

/** An error that the user can correct, with a complete message. */
export class UserError extends Error {}

/** Run a command; end with 2 and one line if the user can correct the error. */
export async function run(command) {
  try {
    process.exitCode = await command();
  } catch (error) {
    if (!(error instanceof UserError) && !error.code?.startsWith('ERR_PARSE_ARGS')) throw error;
    console.error(error.message);
    process.exitCode = 2;
  }
}

/** Serve a bag with a layout; return the server and the address to open in a browser. */
export async function serve({ bag, layout, colours, modules, web, port = 0 }) {
  if (!web && !existsSync(path.join(modules, '@foxglove'))) {
    throw new UserError(`${modules}: the viewer is not installed; run npm install in ${HERE}`);
  }
  const recording = mcap(path.resolve(bag));
  const shown = file(path.resolve(layout));
  const places = { '/bag/': path.dirname(recording) };
  if (web) Object.assign(places, { '/': path.resolve(web) });
  else {
    Object.assign(places, {
      '/modules/': path.resolve(modules),
      '/layout/': path.dirname(shown),
      '/': HERE,
    });
  }
  const server = createServer(answer(places, web ? { '/': started(web, shown) } : {}));
  await new Promise((done, failed) => {
    server.on('error', failed);
    server.listen(port, '127.0.0.1', done);
  });
  const root = `http://127.0.0.1:${server.address().port}`;
  const data = {
    ds: 'remote-file',
    'ds.url': `${root}/bag/${encodeURIComponent(path.basename(recording))}`,
  };
  const own = web ? {} : { layout: path.basename(shown), colours };
  const query = new URLSearchParams({ ...own, ...data });
  const address = `${root}/${web ? '' : 'page.html'}?${query}`;
  return { server, recording, layout: shown, address };
}

/** Return the first page of a Lichtblick for the web, with a layout as its default. */
function started(web, layout) {
  const page = readFileSync(file(path.join(web, 'index.html')), 'utf8');
  const place = '/*LICHTBLICK_SUITE_DEFAULT_LAYOUT_PLACEHOLDER*/';
  if (!page.includes(place)) throw new UserError(`${web}: no Lichtblick for the web`);
  return page.replace(place, () => readFileSync(layout, 'utf8').replaceAll('<', '\\u003c'));
}

/** Return the file of a bag, or its first one if it is a folder. */
function mcap(bag) {
  if (!statSync(bag, { throwIfNoEntry: false })?.isDirectory()) return file(bag);
  const [name] = readdirSync(bag).filter((found) => found.endsWith('.mcap')).sort();
  if (!name) throw new UserError(`${bag}: no .mcap file in it`);
  return path.join(bag, name);
}

function file(name) {
  if (!existsSync(name)) throw new UserError(`${name}: no such file`);
  return name;
}

/** Return what answers requests: pages, whole files and parts, from a folder for each prefix. */
function answer(places, pages) {
  return (request, response) => {
    const { pathname } = new URL(request.url, 'http://127.0.0.1');
    if (pathname in pages) {
      response.writeHead(200, { 'Content-Type': KINDS['.html'] }).end(pages[pathname]);
      return;
    }
    const prefix = Object.keys(places).find((name) => pathname.startsWith(name));
    const rest = path.normalize(`/${decodeURIComponent(pathname.slice(prefix.length))}`);
    const name = path.join(places[prefix], rest);
    const found = statSync(name, { throwIfNoEntry: false });
    if (!found?.isFile()) {
      response.writeHead(404).end();
      return;
    }
    const head = {
      'Accept-Ranges': 'bytes',
      'Content-Type': KINDS[path.extname(name)] ?? 'application/octet-stream',
    };
    const part = /^bytes=(\d+)-(\d*)$/.exec(request.headers.range ?? '');
    const start = part ? Number(part[1]) : 0;
    const end = Math.min(part?.[2] ? Number(part[2]) : Infinity, found.size - 1);
    if (part) head['Content-Range'] = `bytes ${start}-${end}/${found.size}`;
    response.writeHead(part ? 206 : 200, { ...head, 'Content-Length': end - start + 1 });
    if (request.method === 'HEAD') response.end();
    else createReadStream(name, { start, end }).pipe(response);
  };
}
