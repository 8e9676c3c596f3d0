// A browser without a display, whose WebGPU runs on SwiftShader, and a server for it.
import { spawn } from "node:child_process";
import { existsSync } from "node:fs";
import { chromium } from "playwright-core";

const BROWSERS = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome", "/usr/bin/google-chrome-stable"];
const FLAGS = [
  "--headless=new", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
  "--disable-component-update", "--disable-sync", "--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader",
  // The browser draws its pages by SwiftShader's Vulkan too: without it a WebGPU canvas can't be shown, and the device is lost.
  "--enable-features=Vulkan", "--use-vulkan=swiftshader", "--use-angle=swiftshader", "--ignore-gpu-blocklist",
];

export async function launch() {
  const executablePath = BROWSERS.find((path) => existsSync(path));
  if (!executablePath) throw new Error(`none of ${BROWSERS.join(", ")} is installed; scripts/install-browser.sh installs one`);
  return chromium.launch({ executablePath, args: FLAGS });
}

/// Serves a folder by `lightgraph serve`; its address, and how to end it.
export async function serve(lightgraph, folder) {
  const server = spawn(lightgraph, ["serve", folder, "--port", "0"], { stdio: ["ignore", "pipe", "inherit"] });
  const url = await new Promise((found, failed) => {
    server.stdout.on("data", (text) => {
      const at = /http:\/\/\S+/.exec(String(text));
      if (at) found(at[0]);
    });
    server.on("exit", (code) => failed(new Error(`lightgraph serve ended with ${code}`)));
  });
  return { url, end: () => server.kill() };
}

/// Waits until a test of the page holds, however busy the machine is; a fault names what was waited for.
export async function until(page, what, test, arg) {
  try {
    await page.waitForFunction(test, arg, { timeout: 300_000, polling: 30 });
  } catch (error) {
    throw new Error(`the page does not come to ${what}: ${error.message}`);
  }
}

/// Waits until the page shows what was asked for last.
export async function shown(page, states = ["shown"]) {
  await until(page, states.join(" or "), (s) => s.includes(document.body.dataset.state), states);
  return page.evaluate(() => document.body.dataset.state);
}
