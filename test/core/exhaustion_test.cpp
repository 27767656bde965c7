// Memory and threads that ran out, told from other errors.

#include "photosphere/core/exhaustion.h"

#include <gtest/gtest.h>

#include <new>
#include <stdexcept>
#include <system_error>

namespace photosphere {
namespace {

template <class E>
Resource lackingIn(const E& error) {
  try {
    throw error;
  } catch (...) {
    return exhausted();
  }
}

TEST(Exhaustion, IsKnownByTypesAndByTheWordsOfLibraries) {
  EXPECT_EQ(exhausted(), Resource::none);
  EXPECT_EQ(lackingIn(std::bad_alloc()), Resource::memory);
  EXPECT_EQ(lackingIn(std::bad_array_new_length()), Resource::memory);
  EXPECT_EQ(lackingIn(std::system_error(std::make_error_code(std::errc::not_enough_memory))),
            Resource::memory);
  EXPECT_EQ(
      lackingIn(std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again))),
      Resource::threads);
  EXPECT_EQ(lackingIn(std::runtime_error("std::bad_alloc")), Resource::memory);
  EXPECT_EQ(lackingIn(std::runtime_error("pthread_create has failed: Resource unavailable")),
            Resource::threads);
}

TEST(Exhaustion, IsNotWhatAFileSays) {
  for (const char* words :
       {"grid 'std::bad_alloc' is damaged", "bad_alloc", "failed. std::bad_alloc",
        "key 'pthread_create has failed' is unknown", ""})
    EXPECT_EQ(lackingIn(std::runtime_error(words)), Resource::none) << words;
  EXPECT_EQ(
      lackingIn(std::system_error(std::make_error_code(std::errc::no_such_file_or_directory))),
      Resource::none);
  EXPECT_EQ(lackingIn(7), Resource::none);
}

}  // namespace
}  // namespace photosphere
