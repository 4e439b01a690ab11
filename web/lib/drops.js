// Watches the page for files: `tell(text or null)` shows what a drop would do.
export function watchDrops(page, { take, tell }) {
  let depth = 0;
  const isFiles = (event) => event.dataTransfer?.types.includes("Files");
  page.addEventListener("dragenter", (event) => {
    if (!isFiles(event)) return;
    depth += 1;
    tell(
      "Scenes (GLB, USDZ, JSON, a zipped model), meshes (OBJ, PLY, STL), light (HDR, EXR), images and texture sets (PNG, JPEG, ZIP)",
    );
  });
  page.addEventListener("dragleave", (event) => {
    if (isFiles(event) && (depth -= 1) <= 0) tell(null);
  });
  page.addEventListener("dragover", (event) => {
    if (isFiles(event)) event.preventDefault();
  });
  page.addEventListener("drop", (event) => {
    depth = 0;
    tell(null);
    if (event.defaultPrevented || !event.dataTransfer?.files.length) return;
    event.preventDefault();
    take([...event.dataTransfer.files], { x: event.clientX, y: event.clientY });
  });
}
