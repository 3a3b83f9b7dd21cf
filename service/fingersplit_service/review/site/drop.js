// A file field that takes dropped files and says what it holds.

export function watchDrop(drop, field, invitation, hint) {
  const tell = (file) => {
    drop.querySelector("strong").textContent = file ? file.name : invitation;
    drop.querySelector(".hint").textContent = file ? (file.size < 1e5 ? `${(file.size / 1e3).toFixed(1)} kB` : `${(file.size / 1e6).toFixed(2)} MB`) : hint;
  };
  field.addEventListener("change", () => tell(field.files[0]));
  for (const name of ["dragover", "dragleave", "drop"]) {
    drop.addEventListener(name, (event) => {
      event.preventDefault();
      drop.classList.toggle("over", name === "dragover");
      if (name === "drop" && event.dataTransfer.files.length) {
        field.files = event.dataTransfer.files;
        tell(field.files[0]);
        field.dispatchEvent(new Event("change"));
      }
    });
  }
}
