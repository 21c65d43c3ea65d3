// Serves a viewer with a bag and the layout open, for a browser on this machine.

import { parseArgs } from 'node:util';

import { OPTIONS, UserError, run, serve } from './serve.mjs';

const USAGE = `usage: node open.mjs [options] BAG

Serves a viewer with BAG (a folder or an .mcap file) and the layout open, and prints its address for
a browser. Only this machine can reach it. Ctrl-C ends it.

  --port N          (default 8765)
  --layout FILE     (default config/foxglove_layout.json)
  --colours SCHEME  light, dark or system (default light)
  --modules FOLDER  where the viewer is installed (default node_modules beside this file)
  --web FOLDER      use the Lichtblick for the web in this folder instead (its index.html is there)`;

await run(async () => {
  const { values, positionals } = parseArgs({
    allowPositionals: true,
    options: { ...OPTIONS, port: { type: 'string', default: '8765' } },
  });
  if (values.help) {
    console.log(USAGE);
    return 0;
  }
  if (positionals.length !== 1) throw new UserError(USAGE);
  const port = Number(values.port);
  if (!Number.isInteger(port) || port < 0 || port > 65535) {
    throw new UserError(`--port ${values.port}: give a whole number from 0 to 65535`);
  }
  try {
    const { address } = await serve({ ...values, bag: positionals[0], port });
    console.log(`open ${address}`);
  } catch (error) {
    if (error.code !== 'EADDRINUSE') throw error;
    throw new UserError(`--port ${port}: in use by another program; give another port`);
  }
  return 0;
});
