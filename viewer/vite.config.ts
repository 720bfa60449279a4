import { defineConfig } from "vitest/config";

// One script and one style sheet, with the worker inside the script: the page also has to work as a single file from
// disk, where browsers load neither modules nor workers.
export default defineConfig({
  base: "./",
  build: {
    outDir: "../python/mirrorbake/viewer/page",
    emptyOutDir: true,
    target: "es2022",
    cssCodeSplit: false,
    lib: { entry: "src/main.ts", formats: ["iife"], name: "mirrorbake", fileName: () => "viewer.js" },
    rollupOptions: { output: { assetFileNames: "viewer[extname]" } },
  },
  test: { include: ["tests/unit/**/*.test.ts"] },
});
