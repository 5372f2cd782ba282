"use strict";

// Renders the OpenAPI document of this server as forms that send real requests.

const MAX_SHOWN = 20000;

function element(tag, attributes = {}, ...children) {
  const node = Object.assign(document.createElement(tag), attributes);
  node.append(...children);
  return node;
}

function field(name, text, input) {
  return element("label", {}, element("span", {}, `${name} ${text ? `(${text})` : ""}`), input);
}

function parameterField(parameter) {
  const schema = parameter.schema ?? {};
  const example = schema.examples?.[0];
  const hint = [parameter.description ?? schema.description, example && `such as ${example}`];
  const input = element("input", {
    name: parameter.name,
    required: parameter.required ?? false,
    value: schema.default ?? "",
  });
  return field(parameter.name, hint.filter(Boolean).join("; "), input);
}

function requestFor(path, method, operation, form, root) {
  const query = new URLSearchParams();
  const options = { method: method.toUpperCase(), headers: {} };
  let target = `${root}${path}`;
  for (const parameter of operation.parameters ?? []) {
    const value = form.elements[parameter.name].value;
    if (parameter.in === "path") {
      target = target.replace(`{${parameter.name}}`, encodeURIComponent(value));
    } else if (value !== "" && parameter.in === "header") {
      options.headers[parameter.name] = value;
    } else if (value !== "") {
      query.set(parameter.name, value);
    }
  }
  if (form.elements.body) {
    options.body = form.elements.body.value;
    options.headers["Content-Type"] = "application/json";
  }
  return [query.size ? `${target}?${query}` : target, options];
}

// An object of the description itself, or the one that it refers to.
function resolved(schema, description) {
  const names = schema.$ref?.replace("#/", "").split("/") ?? [];
  return names.length ? names.reduce((part, name) => part[name], description) : schema;
}

async function readable(response) {
  const type = response.headers.get("Content-Type") ?? "";
  if (!/json|text/.test(type)) {
    return `${(await response.blob()).size} bytes of ${type}`;
  }
  let text = await response.text();
  if (type.includes("json") && text.length <= MAX_SHOWN) {
    text = JSON.stringify(JSON.parse(text), null, 2);
  }
  return text.length > MAX_SHOWN ? `${text.slice(0, MAX_SHOWN)}\n… ${text.length} characters` : text;
}

async function send(path, method, operation, form, output, root) {
  const [target, options] = requestFor(path, method, operation, form, root);
  output.textContent = `${options.method} ${target}\n…`;
  try {
    const response = await fetch(target, options);
    const heading = `${options.method} ${target}\n${response.status} ${response.statusText}`;
    output.textContent = `${heading}\n\n${await readable(response)}`;
  } catch (error) {
    output.textContent = `The request failed: ${error}`;
  }
}

function operationBlock(path, method, operation, description) {
  const heading = element("summary", {},
    element("span", { className: "method" }, method.toUpperCase()),
    element("code", {}, path),
    element("span", { className: "text" }, ` ${operation.description ?? ""}`));
  const form = element("form");
  for (const parameter of operation.parameters ?? []) {
    form.append(parameterField(parameter));
  }
  const body = operation.requestBody?.content["application/json"];
  if (body) {
    const value = JSON.stringify(resolved(body.schema, description).example ?? {}, null, 2);
    form.append(field("body", "JSON", element("textarea", { name: "body", value })));
  }
  form.append(element("button", { type: "submit" }, "Send"));
  const output = element("pre", { ariaLive: "polite" }, "The answer appears here.");
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    send(path, method, operation, form, output, description.servers?.[0].url ?? "");
  });
  return element("details", {}, heading, form, output);
}

async function render() {
  const about = document.getElementById("about");
  const response = await fetch("openapi.json");
  if (!response.ok) {
    about.textContent = `The description cannot be loaded: ${response.status}.`;
    return;
  }
  const document_ = await response.json();
  about.textContent = `${document_.info.description} Version ${document_.info.version}.`;
  const sections = new Map();
  for (const [path, methods] of Object.entries(document_.paths)) {
    for (const [method, operation] of Object.entries(methods)) {
      const tag = operation.tags?.[0] ?? "other";
      if (!sections.has(tag)) {
        sections.set(tag, element("section", {}, element("h2", {}, tag)));
      }
      sections.get(tag).append(operationBlock(path, method, operation, document_));
    }
  }
  document.getElementById("operations").append(...sections.values());
}

render();
