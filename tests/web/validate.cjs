// Prints the Khronos validator's report on a GLB as JSON: node validate.cjs FILE.glb
const fs = require("node:fs");
const validator = require("gltf-validator");

validator
  .validateBytes(new Uint8Array(fs.readFileSync(process.argv[2])), { maxIssues: 100 })
  .then((report) => console.log(JSON.stringify(report.issues)));
