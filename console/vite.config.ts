import { defineConfig } from "vite";

// Nothing is inlined and nothing is fetched from elsewhere, so that the gateway may forbid both to the browser.
export default defineConfig({
  base: "./",
  build: {
    outDir: "../rbxcompose/domains/console/static",
    emptyOutDir: true,
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    target: "es2022",
    license: { fileName: "licenses.md" }, // of what is in the page
  },
  server: { proxy: { "/console": "http://127.0.0.1:8080", "/rosbridge": { target: "ws://127.0.0.1:8080", ws: true } } },
});
