// Bundles the page into the Python package, so that who installs the package needs no Node.
import { createHash } from "node:crypto";
import { cpSync, mkdirSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

import { build } from "esbuild";

const here = fileURLToPath(new URL(".", import.meta.url));
const out = join(here, "../../clutter6d/assets/review/static");
const { version } = JSON.parse(readFileSync(join(here, "node_modules/three/package.json"), "utf8"));

rmSync(out, { recursive: true, force: true });
mkdirSync(out, { recursive: true });
cpSync(join(here, "public"), out, { recursive: true });
await build({
  absWorkingDir: here,
  entryPoints: ["src/review.ts", "src/review.css"],
  outdir: out,
  bundle: true,
  minify: true,
  format: "esm",
  target: "es2022",
  legalComments: "none",
  banner: { js: `/* Clutter6D review page (Apache-2.0) with three.js ${version} (MIT); see THIRD_PARTY.txt */` },
});
writeFileSync(
  join(out, "THIRD_PARTY.txt"),
  `The review page contains three.js ${version}, under these terms:\n\n` +
    readFileSync(join(here, "node_modules/three/LICENSE"), "utf8"),
);

// What it was built from, so that a test can tell a bundle that is out of date.
const sources = ["package-lock.json", "build.mjs"];
for (const folder of ["public", "src"]) sources.push(...readdirSync(join(here, folder)).map((name) => `${folder}/${name}`));
const digest = createHash("sha256");
for (const name of sources.sort()) digest.update(`${name}\n`).update(readFileSync(join(here, name)));
writeFileSync(join(here, "built-from.sha256"), `${digest.digest("hex")}\n`);
