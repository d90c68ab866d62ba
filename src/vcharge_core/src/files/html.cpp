#include "vcharge_core/files/html.h"

namespace vcharge {
namespace {

const char* const kStyle =
    "body{font:15px/1.45 sans-serif;margin:2em auto;max-width:1100px;color:#222;padding:0 1em}"
    "h1{font-size:1.5em}h2{font-size:1.15em;margin-top:1.8em}"
    ".verdict{padding:.7em 1em;border-radius:6px;color:#fff;font-size:1.1em}"
    ".PASS,.GOOD{background:#2c6e2f}.WARN,.CHECK{background:#a06a00}.FAIL,.BAD{background:#b3261e}"
    "table{border-collapse:collapse}td,th{padding:.2em .8em;border-bottom:1px solid #ddd;text-align:right}"
    "td:first-child,th:first-child,td.text{text-align:left}"
    ".row{display:flex;flex-wrap:wrap;gap:1em}.row>figure{flex:1 1 300px;margin:0}figure{margin:0}"
    "svg,img{width:100%;height:auto}figcaption{color:#555;font-size:.9em}"
    "td svg.bar{width:80px;height:8px}";

}  // namespace

std::string escapeHtml(const std::string& text) {
  std::string result;
  for (const char letter : text) {
    if (letter == '<') {
      result += "&lt;";
    } else if (letter == '>') {
      result += "&gt;";
    } else if (letter == '&') {
      result += "&amp;";
    } else if (letter == '"') {
      result += "&quot;";
    } else {
      result += letter;
    }
  }
  return result;
}

std::string htmlFigure(const std::string& picture, const std::string& caption) {
  return "<figure>" + picture + "<figcaption>" + escapeHtml(caption) + "</figcaption></figure>";
}

std::string htmlRow(const std::vector<std::string>& cells, bool is_head) {
  const std::string tag = is_head ? "th>" : "td>";
  std::string text = "<tr>";
  for (const std::string& cell : cells) {
    text += "<" + tag + escapeHtml(cell) + "</" + tag;
  }
  return text + "</tr>";
}

std::string htmlVerdict(const std::string& verdict, const std::vector<std::string>& remarks) {
  std::string text = "<p class=\"verdict " + verdict + "\"><b>" + verdict + "</b>";
  for (const std::string& remark : remarks) {
    text += "<br>" + escapeHtml(remark);
  }
  return text + "</p>";
}

std::string htmlPage(const std::string& title, const std::string& body) {
  return "<!DOCTYPE html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>" + escapeHtml(title) +
         "</title><style>" + kStyle + "</style></head><body><h1>" + escapeHtml(title) + "</h1>" + body +
         "</body></html>\n";
}

}  // namespace vcharge
