#pragma once

#include <string>

namespace vcharge {

/// Text as it may stand inside an element or an attribute.
std::string escapeHtml(const std::string& text);

/// A picture (an <svg> or <img> element) with a caption, which is escaped.
std::string htmlFigure(const std::string& picture, const std::string& caption);

/// A whole page that needs nothing beside it, in the style that all reports share: tables, rows of figures
/// (class "row"), and verdicts (class "verdict" with PASS or GOOD, WARN or CHECK, FAIL or BAD). `body` is
/// HTML that follows the title.
std::string htmlPage(const std::string& title, const std::string& body);

}  // namespace vcharge
