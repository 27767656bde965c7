// Channels, layers and windows.

#include "photosphere/image/image.h"

#include <gtest/gtest.h>

#include <limits>

#include "photosphere/core/error.h"

namespace photosphere::image {
namespace {

TEST(Image, layersGroupColorAndLeaveTheRestAlone) {
  Image image(2, 2);
  for (const char* name : {"A", "B", "G", "R", "Z", "deep.single.R", "deep.single.G",
                           "deep.single.B", "lone.R", "N.X"})
    image.addChannel(name);
  const std::vector<Layer> layers = image.layers();
  ASSERT_EQ(layers.size(), 6u);
  EXPECT_EQ(layers[0].name, "A");
  EXPECT_EQ(layers[1].name, "RGB");
  EXPECT_EQ(layers[1].channels, (std::vector<std::size_t>{3, 2, 1}));
  EXPECT_EQ(layers[2].name, "Z");
  EXPECT_EQ(layers[3].name, "deep.single");
  EXPECT_EQ(layers[4].name, "lone.R");
  EXPECT_EQ(layers[4].channels.size(), 1u);
  EXPECT_EQ(layers[5].name, "N.X");
}

TEST(Image, kindFollowsTheLastPartOfTheName) {
  EXPECT_EQ(channelKindFromName("R"), ChannelKind::color);
  EXPECT_EQ(channelKindFromName("single.A"), ChannelKind::color);
  EXPECT_EQ(channelKindFromName("Z"), ChannelKind::data);
  EXPECT_EQ(channelKindFromName("R.depth"), ChannelKind::data);
  EXPECT_EQ(channelKindFromName("VAR"), ChannelKind::data);
}

TEST(Image, copiesAreIndependent) {
  Image a(2, 1);
  a.addLayer("", ChannelKind::color);
  Image b = a;
  b.setRgb("", 1, 0, {1, 2, 3});
  EXPECT_EQ(a.rgb("", 1, 0), Rgb(0.0f));
  EXPECT_EQ(b.rgb("RGB", 1, 0), Rgb(1, 2, 3));
}

TEST(Image, unknownChannelListsTheKnown) {
  Image image(1, 1);
  image.addLayer("single", ChannelKind::color);
  try {
    image.channel("R");
    FAIL() << "found";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("single.R, single.G, single.B"), std::string::npos);
  }
  EXPECT_THROW(image.addChannel("single.G"), ConfigError);
  EXPECT_THROW(image.addChannel(""), ConfigError);
}

TEST(Image, impossibleWindowsAreRefused) {
  EXPECT_THROW(Image(0, 4), ConfigError);
  EXPECT_THROW(Image(4, -4), ConfigError);
  EXPECT_THROW(Image(1 << 16, 1 << 16), ConfigError);
  EXPECT_THROW(Image({0, 0, 4, 4}, {0, 0, 0, 0}), ConfigError);
}

TEST(Image, intersectionOfWindows) {
  EXPECT_EQ(intersection({0, 0, 10, 8}, {4, -2, 20, 5}), (Window{4, 0, 6, 3}));
  EXPECT_EQ(intersection({0, 0, 4, 4}, {4, 0, 4, 4}).width, 0);
  constexpr int far = std::numeric_limits<int>::max() - 1;
  EXPECT_EQ(intersection({far, 0, 100, 1}, {far, 0, 100, 1}).width, 100);
}

}  // namespace
}  // namespace photosphere::image
