// SPDX-License-Identifier: Apache-2.0
// A needle in .NET: Needleforce.cs, and a model written by `needleforce export paper --name gel --language c# -o Gel.cs`. Twin of ../c/main.c.
using System;
using System.Globalization;
using Needleforce;

static class Program {
  static void Main() {
    CultureInfo.CurrentCulture = CultureInfo.InvariantCulture;
    using (Insertion gelBlock = new Insertion(gel.Layers)) {
      Sample sample = default(Sample);
      for (int cycle = 0; cycle <= 4000; ++cycle) {  // 8 mm in at 2 mm/s, a step a millisecond
        sample = gelBlock.Step(2e-6 * cycle, 2e-3, 1e-3);
        if (sample.Status != Status.Ok) throw new Exception("refused: " + sample.Status);
        if (sample.Punctured) Console.WriteLine("puncture at {0:F3} mm", 1e3 * sample.Depth);
      }
      Console.WriteLine("force at {0:F1} mm: {1:F4} N", 1e3 * sample.Depth, sample.Force);
    }
  }
}
