// What the browser keeps for this page: small values, and pictures. Without storage (private windows, a full
// disk) the page works on and forgets.

const NAME = "sunbox";
const STORE = "kept";
let opened = null;

function open() {
  opened ??= new Promise((resolve, reject) => {
    const request = indexedDB.open(NAME, 1);
    request.onupgradeneeded = () => request.result.createObjectStore(STORE);
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error);
  });
  return opened;
}

async function act(mode, work) {
  try {
    const store = (await open()).transaction(STORE, mode).objectStore(STORE);
    return await new Promise((resolve, reject) => {
      const request = work(store);
      request.onsuccess = () => resolve(request.result);
      request.onerror = () => reject(request.error);
    });
  } catch {
    return undefined;
  }
}

export const remember = (name, value) => act("readwrite", (store) => store.put(value, name));
export const recall = (name) => act("readonly", (store) => store.get(name));
export const dismiss = (name) => act("readwrite", (store) => store.delete(name));

// [{name, value}] of all names that begin so.
export async function recallAll(start) {
  const range = IDBKeyRange.bound(start, `${start}\uffff`);
  const names = (await act("readonly", (store) => store.getAllKeys(range))) ?? [];
  const values = (await act("readonly", (store) => store.getAll(range))) ?? [];
  return names.map((name, i) => ({ name, value: values[i] }));
}
