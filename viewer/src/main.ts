import { App } from "./app";
import { EmbeddedFiles, ServedFiles } from "./files";
import "./style.css";

const place = document.getElementById("viewer");
if (place) {
  const { data } = place.dataset;
  const files = data === "embedded" ? new EmbeddedFiles() : new ServedFiles(data ?? "");
  const app = new App(place, files);
  // For measurements and for whoever drives the page from a script; documented in docs/guide/use-the-result.md.
  (window as unknown as { mirrorbake: App }).mirrorbake = app;
  if (data !== "embedded" && location.protocol === "file:") {
    app.controls.warn(
      "This page has to come from a web server. Open it with mirrorbake view, or export the PEM with --single-file.",
    );
  } else {
    void app.start();
  }
}
