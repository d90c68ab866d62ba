#include "vcharge_core/files/html.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace vcharge {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(HtmlTest, TextCannotBecomeMarkup) {
  EXPECT_EQ(escapeHtml("a<b> & \"c\""), "a&lt;b&gt; &amp; &quot;c&quot;");
  EXPECT_THAT(htmlFigure("<svg></svg>", "x<y"), HasSubstr("<svg></svg><figcaption>x&lt;y</figcaption>"));
  EXPECT_EQ(htmlRow({"a", "1<2"}), "<tr><td>a</td><td>1&lt;2</td></tr>");
  EXPECT_EQ(htmlRow({"a&b"}, true), "<tr><th>a&amp;b</th></tr>");
  EXPECT_EQ(htmlVerdict("CHECK", {"x<y"}), "<p class=\"verdict CHECK\"><b>CHECK</b><br>x&lt;y</p>");
  const std::string page = htmlPage("map of <lot>", "<p>body</p>");
  EXPECT_THAT(page, HasSubstr("<h1>map of &lt;lot&gt;</h1><p>body</p></body></html>"));
  EXPECT_THAT(page, Not(HasSubstr("http")));  // self-contained
}

}  // namespace
}  // namespace vcharge
