// What can be known of a file before it is sent.

const GLB = 0x46546c67; // "glTF"

// Raises what is known to be wrong with a file before it is sent. `formats` is what the server says of them; {} where
// it has not said it.
export async function checkFile(file, { missing = {} }) {
  if (!file.size) throw new Error("The file is empty.");
  const ending = file.name.split(".").at(-1).toLowerCase();
  const format = ending.startsWith("usd") ? "usd" : ending === "stp" ? "step" : ending;
  if (missing[format]) throw new Error(`${format.toUpperCase()} files need ${missing[format]} on the server.`);
  if (ending !== "glb") return;
  const head = new DataView(await file.slice(0, 4).arrayBuffer());
  if (head.byteLength < 4 || head.getUint32(0, true) !== GLB) throw new Error("It is no GLB file.");
}
