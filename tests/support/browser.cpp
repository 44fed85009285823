// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "browser.h"

#include <png.h>
#include <unistd.h>

#include <cstdlib>
#include <sstream>
#include <stdexcept>

#include "subprocess.h"

namespace btgpu::test {
namespace {

Finished browse(const std::vector<std::string>& options, const TemporaryFolder& folder, const std::string& page,
                int width, int height, Scheme scheme) {
  std::vector<std::string> command = {
      browserPath(), "--headless",
      "--no-sandbox",  // which does not work for root
      "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars",
      "--host-resolver-rules=MAP * ~NOTFOUND",  // no network
      "--user-data-dir=" + folder.file("profile"),
      "--window-size=" + std::to_string(width) + "," + std::to_string(height),
      // Blink's names of the two are 1 and 0.
      scheme == Scheme::Light ? "--blink-settings=preferredColorScheme=1" : "--blink-settings=preferredColorScheme=0"};
  command.insert(command.end(), options.begin(), options.end());
  command.push_back("file://" + page);
  const Finished run = runProgram(command, {{"HOME=" + folder.path().string()}, 200});
  if (run.exitCode != 0) throw std::runtime_error("the browser failed: " + run.err.substr(0, 2000));
  return run;
}

}  // namespace

std::array<int, 3> Screenshot::at(int x, int y) const {
  const size_t i = 3 * (static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x));
  return {rgb.at(i), rgb.at(i + 1), rgb.at(i + 2)};
}

std::string browserPath() {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    for (const char* name : {"chromium", "chromium-browser", "google-chrome"}) {
      const std::string file = folder + "/" + name;
      if (access(file.c_str(), X_OK) == 0) return file;
    }
  }
  throw std::runtime_error("no browser to look at the report with: run scripts/setup.sh chromium");
}

std::string dumpDom(const std::string& page, int width, Scheme scheme) {
  const TemporaryFolder folder;
  return browse({"--dump-dom"}, folder, page, width, 1000, scheme).out;
}

Screenshot takeScreenshot(const std::string& page, int width, int height, Scheme scheme) {
  const TemporaryFolder folder;
  const std::string file = folder.file("page.png");
  browse({"--screenshot=" + file}, folder, page, width, height, scheme);
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_file(&png, file.c_str())) throw std::runtime_error("no screenshot was taken");
  png.format = PNG_FORMAT_RGB;
  Screenshot shot{static_cast<int>(png.width), static_cast<int>(png.height), {}};
  shot.rgb.resize(PNG_IMAGE_SIZE(png));
  if (!png_image_finish_read(&png, nullptr, shot.rgb.data(), 0, nullptr)) throw std::runtime_error(png.message);
  return shot;
}

}  // namespace btgpu::test
