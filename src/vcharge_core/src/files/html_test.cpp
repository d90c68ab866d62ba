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
  const std::string page = htmlPage("map of <lot>", "<p>body</p>");
  EXPECT_THAT(page, HasSubstr("<h1>map of &lt;lot&gt;</h1><p>body</p></body></html>"));
  EXPECT_THAT(page, Not(HasSubstr("http")));  // self-contained
}

}  // namespace
}  // namespace vcharge
