import { defineConfig } from "vitest/config";

// Browsers share two cores with everything else: one test file after the other.
export default defineConfig({
  test: {
    include: ["tests/browser/**/*.test.ts"],
    fileParallelism: false,
    testTimeout: 60000,
    hookTimeout: 30000,
  },
});
