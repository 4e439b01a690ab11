// The API's pages, drawn from openapi.json: no other host, no library.

const METHODS = ["get", "post", "put", "delete"];

function element(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

function resolved(schema, description) {
  if (!schema?.$ref) return schema ?? {};
  return schema.$ref
    .slice(2)
    .split("/")
    .reduce((at, key) => at[key], description);
}

function values(schema) {
  if (schema.anyOf)
    return schema.anyOf
      .filter(({ type }) => type !== "null")
      .map(values)
      .join(" | ");
  if (schema.enum) return schema.enum.join(" | ");
  const low = schema.minimum ?? "",
    high = schema.maximum ?? "";
  return [schema.type, low === "" && high === "" ? "" : `${low} … ${high}`].filter(Boolean).join(" ");
}

function parameters(call, description) {
  if (!call.parameters?.length) return [];
  const rows = call.parameters.map((parameter) => {
    const schema = resolved(parameter.schema, description);
    const normally = parameter.schema?.default ?? schema.default;
    return element(
      "tr",
      {},
      element("td", {}, element("code", { textContent: parameter.name })),
      element("td", { textContent: parameter.in }),
      element("td", { textContent: values(schema) }),
      element("td", { textContent: normally === undefined ? "" : String(normally) }),
    );
  });
  const head = element(
    "tr",
    {},
    ...["name", "in", "values", "default"].map((textContent) => element("th", { textContent })),
  );
  return [element("table", {}, head, ...rows)];
}

function section(method, path, call, description) {
  const heading = element(
    "h3",
    {},
    element("span", { className: "method", textContent: method.toUpperCase() }),
    element("code", { textContent: path }),
  );
  const bodies = Object.keys(call.requestBody?.content ?? {});
  const answers = Object.entries(call.responses ?? {})
    .filter(([status]) => status < 300)
    .map(([status]) => status);
  const facts = [
    bodies.length ? `Body: ${bodies.join(", ")}. ` : "",
    answers.length ? `Answers ${answers.join(", ")}.` : "",
  ];
  return element(
    "section",
    {},
    heading,
    element("p", { textContent: `${call.summary ?? ""}. ${facts.join("")}` }),
    ...parameters(call, description),
  );
}

async function show() {
  const calls = document.getElementById("calls");
  const answer = await fetch("openapi.json");
  if (!answer.ok) {
    calls.textContent = `The description could not be read: ${answer.status} ${answer.statusText}.`;
    return;
  }
  const description = await answer.json();
  document.getElementById("about").textContent =
    `${description.info.description} Version ${description.info.version}.`;
  calls.replaceChildren(
    ...Object.entries(description.paths).flatMap(([path, methods]) =>
      METHODS.filter((method) => methods[method]).map((method) =>
        section(method, path, methods[method], description),
      ),
    ),
  );
}

show();
