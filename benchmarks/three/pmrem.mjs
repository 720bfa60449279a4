// node pmrem.mjs FOLDER: reads request.json, panorama.f32 and directions.f32 there, prints what page.js finds.
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { chromium } from "playwright-core";

const here = import.meta.dirname ?? new URL(".", import.meta.url).pathname;
const folder = process.argv[2];
const files = {
  "/": [
    "text/html",
    Buffer.from(
      '<script type="importmap">{"imports": {"three": "/three/three.module.js"}}</script><script type="module" src="/page.js"></script>',
    ),
  ],
  "/page.js": ["text/javascript", await readFile(join(here, "page.js"))],
  "/panorama": ["application/octet-stream", await readFile(join(folder, "panorama.f32"))],
  "/directions": ["application/octet-stream", await readFile(join(folder, "directions.f32"))],
};

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--no-first-run", "--disable-background-networking", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
try {
  const page = await browser.newPage();
  page.setDefaultTimeout(240_000);
  page.on("pageerror", (error) => console.error(String(error)));
  await page.route("**/*", async (route) => {
    const { pathname } = new URL(route.request().url());
    if (pathname.startsWith("/three/")) {
      const body = await readFile(join(here, "node_modules/three/build", pathname.slice("/three/".length)));
      return route.fulfill({ contentType: "text/javascript", body });
    }
    const known = files[pathname];
    return known ? route.fulfill({ contentType: known[0], body: known[1] }) : route.fulfill({ status: 404 });
  });
  await page.goto("http://bench.invalid/");
  await page.waitForFunction(() => window.filter);
  const request = JSON.parse(await readFile(join(folder, "request.json"), "utf8"));
  console.log(JSON.stringify(await page.evaluate((r) => window.filter(r), request)));
} finally {
  await browser.close();
}
