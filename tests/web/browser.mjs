// A Chromium for the tests: Debian's, with a profile of its own.

import { existsSync, mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { chromium } from 'playwright-core';

const PLACES = [process.env.GABLE_CHROMIUM, '/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'];
const FLAGS = [
  '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run', '--disable-background-networking',
  '--disable-component-update', '--disable-sync', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
];

export async function open(options = {}) {
  const executablePath = PLACES.find((path) => path && existsSync(path));
  const profile = mkdtempSync(join(tmpdir(), 'gable-chromium-'));
  const context = await chromium.launchPersistentContext(profile, {
    executablePath, headless: true, args: FLAGS, viewport: { width: 1360, height: 850 }, ...options,
  });
  return {
    context,
    close: async () => {
      await context.close();
      rmSync(profile, { recursive: true, force: true });
    },
  };
}

/// Logs the browser in at the service, on all its pages.
export const logIn = (context, token) =>
  context.addInitScript((known) => {
    // Empty pages have no storage.
    if (location.protocol.startsWith('http')) localStorage.setItem('gable.token', known);
  }, token);

/// A page that fails the test on an error of script, and on anything that is asked for from elsewhere.
export async function page(context, address, problems) {
  const made = await context.newPage();
  made.on('pageerror', (error) => problems.push(`script: ${error.stack ?? error.message}`));
  made.on('console', (message) => {
    // The browser notes each answer that is no success; tests look at those themselves.
    if (message.type() === 'error' && !message.text().startsWith('Failed to load resource')) problems.push(`console: ${message.text()}`);
  });
  made.on('request', (request) => {
    const url = request.url();
    if (!url.startsWith(address) && !/^(blob|data):/.test(url)) problems.push(`asks elsewhere: ${url}`);
  });
  return made;
}

export function check(holds, what) {
  if (!holds) throw new Error(what);
}

/// Waits until something holds, and gives it.
export async function until(what, ask, limit = 120_000) {
  const begin = Date.now();
  for (;;) {
    const found = await ask();
    if (found) return found;
    if (Date.now() - begin > limit) throw new Error(`never: ${what}`);
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
}
