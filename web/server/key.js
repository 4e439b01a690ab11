// The key of a server that asks for one: kept for this tab, and forgotten with it.

const PLACE = "sunbox.key";

export const readKey = () => sessionStorage.getItem(PLACE);
const writeKey = (key) => sessionStorage.setItem(PLACE, key);

// Asks for the key in a dialog of the page: resolves once something was entered.
export function askForKey(dialog, wasWrong) {
  const [form, entry, trouble] = ["form", "input", ".trouble"].map((selector) => dialog.querySelector(selector));
  trouble.hidden = !wasWrong;
  if (!dialog.open) dialog.showModal();
  entry.value = "";
  return new Promise((resolve) => {
    form.onsubmit = (event) => {
      event.preventDefault();
      if (!entry.value.trim()) return;
      writeKey(entry.value.trim());
      dialog.close();
      resolve();
    };
  });
}
