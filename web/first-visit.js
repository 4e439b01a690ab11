// The page comes with a picture of its first scene, which is seen before any other code is there. Whoever comes back to
// work of his own, or follows a link, is not shown it.

const hasWork = () => {
  try {
    return Object.keys(localStorage).some((key) => key.startsWith("sunbox.work ")); // document/work.js keeps it so
  } catch {
    return false; // there is no storage, and so no work
  }
};

document.documentElement.classList.toggle("again", location.hash.length > 1 || hasWork());
