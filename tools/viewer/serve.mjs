// The viewer, a bag and a layout behind one address: what `open` and `check` have in common.

import { createReadStream, existsSync, readdirSync, statSync } from 'node:fs';
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
export async function serve({ bag, layout, colours, modules, port = 0 }) {
  if (!existsSync(path.join(modules, '@foxglove'))) {
    throw new UserError(`${modules}: the viewer is not installed; run npm install in ${HERE}`);
  }
  const recording = mcap(path.resolve(bag));
  const shown = file(path.resolve(layout));
  const server = createServer(answer({
    '/modules/': path.resolve(modules),
    '/layout/': path.dirname(shown),
    '/bag/': path.dirname(recording),
    '/': HERE,
  }));
  await new Promise((done, failed) => {
    server.on('error', failed);
    server.listen(port, '127.0.0.1', done);
  });
  const root = `http://127.0.0.1:${server.address().port}`;
  const query = new URLSearchParams({
    layout: path.basename(shown),
    colours,
    ds: 'remote-file',
    'ds.url': `${root}/bag/${encodeURIComponent(path.basename(recording))}`,
  });
  return { server, recording, layout: shown, address: `${root}/page.html?${query}` };
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

/** Return what answers requests: whole files and parts of them, from a folder for each prefix. */
function answer(places) {
  return (request, response) => {
    const { pathname } = new URL(request.url, 'http://127.0.0.1');
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
