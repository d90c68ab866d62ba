#pragma once

#include <string>
#include <vector>

namespace vcharge {

/// Escapes text for use in an element or attribute.
std::string escapeHtml(const std::string& text);

/// A figure (an <svg> or <img> element) with a caption, which is escaped.
std::string htmlFigure(const std::string& picture, const std::string& caption);

/// A row of a table; the cells' texts are escaped.
std::string htmlRow(const std::vector<std::string>& cells, bool is_head = false);

/// A verdict with its remarks, which are escaped.
std::string htmlVerdict(const std::string& verdict, const std::vector<std::string>& remarks);

/// A self-contained page in the common style of all reports: tables, rows of figures (class "row"), and
/// verdicts (class "verdict" with PASS or GOOD, WARN or CHECK, FAIL or BAD). `body` is the HTML after the
/// title.
std::string htmlPage(const std::string& title, const std::string& body);

}  // namespace vcharge
