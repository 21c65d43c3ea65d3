// Starts the viewer, as its own web edition does, with one layout chosen.

const viewer = globalThis;
const asked = new URLSearchParams(location.search);
const layout = await (await fetch(`/layout/${asked.get('layout')}`)).json();

class Settings {
  #values = new Map([
    ['colorScheme', asked.get('colours')],
    ['timezone', 'UTC'],
    ['launchPreference', 'web'],
    ['ui.open-dialog-startup', false],
    ['telemetry.telemetryEnabled', false],
    ['telemetry.crashReportingEnabled', false],
    ['hideSignInPrompt', true],
  ]);

  get(key) { return this.#values.get(key); }

  async set(key, value) { this.#values.set(key, value); }

  addChangeListener() {}

  removeChangeListener() {}
}

class Layouts {
  #layouts = new Map();

  async list() { return [...this.#layouts.values()]; }

  async get(_, id) { return this.#layouts.get(id); }

  async put(_, layout) {
    this.#layouts.set(layout.id, layout);
    return layout;
  }

  async delete(_, id) { this.#layouts.delete(id); }

  async importLayouts() {}
}

const layouts = new Layouts();
await layouts.put('local', {
  id: 'disc',
  name: 'disc',
  permission: 'CREATOR_WRITE',
  baseline: { data: layout, savedAt: new Date().toISOString() },
});
localStorage.setItem(
  'studio.profile-data',
  JSON.stringify({
    currentLayoutId: 'disc',
    onboarding: { settingsTooltipShownForPanelTypes: ['3D'] },
  }),
);
localStorage.setItem('fox.workspace', JSON.stringify({ state: { sidebarItem: null }, version: 0 }));

await viewer.initI18n?.();
ReactDOM.render(
  React.createElement(viewer.App, {
    deepLinks: [location.href],
    dataSources: [new viewer.McapLocalDataSourceFactory(), new viewer.RemoteDataSourceFactory()],
    appConfiguration: new Settings(),
    layoutStorage: layouts,
    extensionLoaders: [],
    enableGlobalCss: true,
  }),
  document.getElementById('root'),
);
