// SPDX-License-Identifier: Apache-2.0
// The conformance set through Needleforce.cs; README.md says what a case is.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Linq;
using System.Text;
using Needleforce;

class Case {
  static readonly string[] families = { "stiffness", "puncture", "friction", "cutting", "relaxation" };
  static readonly string[] statuses = { "ok", "outside_range", "invalid_parameter", "not_finite" };
  internal static readonly StringBuilder Lines = new StringBuilder();
  readonly List<Layer> layers = new List<Layer>();
  readonly List<LateralLayer> lateral = new List<LateralLayer>();
  readonly List<double[]> knots = new List<double[]>();
  readonly List<Section> sections = new List<Section>();
  readonly Bending bending = new Bending();
  readonly long[] ticks = new long[6];  // depth, and of a needle that bends x, y, tilts, roll
  Settings settings = Settings.Default;
  double spacing;
  double[] compliance;
  Insertion insertion;
  Solid solid;
  FlexibleInsertion needle;
  bool made, accepted;
  byte[] kept;

  static double Number(string word) {
    if (word == "nan") return double.NaN;
    if (word.EndsWith("inf")) return word[0] == '-' ? double.NegativeInfinity : double.PositiveInfinity;
    return double.Parse(word, CultureInfo.InvariantCulture);
  }
  static double Velocity(string word) { return word == "-" ? No.Velocity : Number(word); }
  static double Metres(long ticks) { return ticks * Math.Pow(2, -30); }
  static string Text(double number) { return number.ToString("G17", CultureInfo.InvariantCulture); }
  static void Write(string kind, params double[] numbers) {
    Lines.Append(kind).AppendLine(string.Concat(numbers.Select(each => " " + Text(each))));
  }
  static T Filled<T>(T numbers, IEnumerable<string> words) where T : Numbers {
    string[] all = words.ToArray();
    for (int i = 0; i + 1 < all.Length; i += 2) numbers.Add(all[i], Number(all[i + 1]));
    return numbers;
  }

  // true for a line of the model
  bool Describe(string what, string[] w) {
    if (families.Contains(what)) {
      Law law = Filled(new Law(w[0]), w.Skip(1));
      Layer layer = layers.Last();
      if (what == "stiffness") layer.Stiffness = law;
      if (what == "puncture") layer.Puncture = law;
      if (what == "friction") layer.Friction = law;
      if (what == "cutting") layer.Cutting = law;
      if (what == "relaxation") layer.Relaxation = law;
    } else if (what == "layer") {
      layers.Add(new Layer { Top = Number(w[0]) });
    } else if (what == "set") {
      Set(w[0], Number(w[1]));
    } else if (what == "tip") {
      int at = Array.IndexOf(w, "equivalence");
      IEnumerable<string> numbers = w.Where((word, i) => i > 0 && (at < 0 || i < at || i > at + 1));
      Give(Filled(new Tip(w[0], at > 0 ? w[at + 1] : null), numbers));
      knots.Clear();
    } else if (what == "knot") {
      knots.Add(w.Select(Number).ToArray());
      Give(new Tip(knots.Select(knot => knot[0]).ToArray(), knots.Select(knot => knot[1]).ToArray()));
    } else if (what == "solid") {
      spacing = Number(w[0]);
      int n = int.Parse(w[1]);
      compliance = new double[n * n];
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) compliance[i * n + j] = Number(w[2]) / (1.0 + Number(w[3]) * ((i - j) * (i - j)));
    } else if (what == "lateral") {
      int form = Array.IndexOf(w, "form");
      LateralLayer layer = Filled(new LateralLayer(form > 0 ? w[form + 1] : null), new[] { "top", w[0] });
      lateral.Add(Filled(layer, w.Skip(1).Where((word, i) => form < 0 || i + 1 < form || i > form)));
    } else if (what == "section") {
      sections.Add(new Section { End = Number(w[0]), Stiffness = Number(w[1]), Curvature = Number(w[2]) });
    } else if (what == "bending") {
      if (w[0] == "elements") bending.Elements = int.Parse(w[1]);
      else bending.Lengths.Add(w[0], Number(w[1]));
    } else {
      return false;
    }
    return true;
  }
  void Give(Tip tip) {  // to the law of the last layer
    Law law = layers.Last().Stiffness;
    layers.Last().Stiffness = Filled(new Law(law.Name, tip), law.Cast<KeyValuePair<string, double>>().SelectMany(each => new[] { each.Key, Text(each.Value) }));
  }
  void Set(string name, double value) {
    if (name == "max_speed") settings.MaxSpeed = value;
    if (name == "hold_time") settings.HoldTime = value;
    if (name == "depth_noise") settings.DepthNoise = value;
    if (name == "bevel_half_angle") settings.BevelHalfAngle = value;
    if (name == "bevel_friction_coefficient") settings.BevelFrictionCoefficient = value;
    if (name == "bevel_face_share") settings.BevelFaceShare = value;
  }
  void Make() {
    made = true;
    try {
      if (compliance == null) insertion = new Insertion(layers.ToArray(), settings);
      else solid = new Solid(layers.ToArray(), settings, spacing, compliance);
      bending.Layers = lateral.ToArray();
      bending.Sections = sections.ToArray();
      if (lateral.Count > 0) needle = solid == null ? new FlexibleInsertion(insertion, bending) : new FlexibleInsertion(solid, bending);
      accepted = true;
    } catch (NeedleforceException error) {
      Console.Error.WriteLine(error.Message);
      Lines.AppendLine("refused");
    }
  }

  static void Write(Sample s) {
    double[] numbers = { s.Depth, s.Velocity, s.Force, s.Stiffness, s.Friction, s.Cutting, s.Lateral, s.ForceByDepth, s.ForceByVelocity };
    string words = s.Phase.ToString().ToLowerInvariant() + " " + statuses[(int)s.Status];
    foreach (bool each in new[] { s.Contact, s.Punctured, s.Exit }) words += each ? " 1" : " 0";
    Lines.AppendLine(string.Join(" ", numbers.Select(Text)) + " " + words);
  }
  void Step(double depth, double velocity, double dt) {
    Write(solid == null ? insertion.Step(depth, velocity, dt) : solid.Step(depth, velocity, dt));
  }
  void Bend(double[] at, double dt) {
    Bent s = needle.Step(new Base { Depth = at[0], LateralX = at[1], LateralY = at[2], TiltX = at[3], TiltY = at[4], Roll = at[5] }, dt);
    Write(s.Axial);
    double[] numbers = new[] { s.Tip, s.Tangent, s.BaseForce, s.BaseMoment }.SelectMany(v => new[] { v.X, v.Y, v.Z }).ToArray();
    Lines.Append("bent " + string.Join(" ", numbers.Concat(new[] { s.Force, s.Lateral, s.Unsupported }).Select(Text)));
    Lines.AppendLine(" " + statuses[(int)s.Status] + (s.Buckled ? " 1" : " 0"));
  }
  void Carry(string[] w) {
    for (int i = 0; i < int.Parse(w[0]); ++i) {
      for (int k = 0; k < 6; ++k) ticks[k] += long.Parse(w[2 + k]);
      Bend(ticks.Select(Metres).ToArray(), Number(w[1]));
    }
  }
  void Restore(byte[] bytes) {
    bool taken = needle != null ? needle.Restore(bytes) : solid != null ? solid.Restore(bytes) : insertion.Restore(bytes);
    Lines.AppendLine(taken ? "taken" : "refused");
  }
  void Nodes() {
    Write("tip", solid.Tip);
    double[] displacements = solid.Displacements();
    foreach (double[] node in solid.Forces().Select((force, i) => new[] { force, displacements[i] })) Write("node", node);
  }
  void Move(string what, string[] w) {
    if (!made) Make();
    if (!accepted) return;
    if (what == "at") ticks[0] = long.Parse(w[0]);
    if (what == "go")
      for (int i = 0; i < int.Parse(w[0]); ++i) {
        ticks[0] += long.Parse(w[3 + i % (w.Length - 3)]);
        Step(Metres(ticks[0]), Velocity(w[2]), Number(w[1]));
      }
    if (what == "step") Step(Number(w[0]), Velocity(w[1]), Number(w[2]));
    if (what == "carry") Carry(w);
    if (what == "base") Bend(w.Take(6).Select(Number).ToArray(), Number(w[6]));
    if (what == "shape") {
      double[] all = needle.Shape();
      for (int i = 0; i < all.Length; i += 3) Write("point", all[i], all[i + 1], all[i + 2]);
    }
    if (what == "nodes") Nodes();
    if (what == "reset") { if (needle != null) needle.Reset(); else if (solid != null) solid.Reset(); else insertion.Reset(); }
    if (what == "keep") kept = needle != null ? needle.Snapshot() : solid != null ? solid.Snapshot() : insertion.Snapshot();
    if (what == "restore") Restore(kept);
    if (what == "alter") Restore(kept.Select((b, i) => i == int.Parse(w[0]) ? (byte)(b ^ 1) : b).ToArray());
  }

  static void Main(string[] paths) {
    foreach (string path in paths) {
      Case one = new Case();
      Lines.AppendLine("case " + path);
      foreach (string line in File.ReadLines(path)) {
        string[] words = line.Split(new[] { ' ' }, StringSplitOptions.RemoveEmptyEntries);
        if (words.Length == 0 || words[0][0] == '#') continue;
        if (!one.Describe(words[0], words.Skip(1).ToArray())) one.Move(words[0], words.Skip(1).ToArray());
      }
    }
    Console.Out.Write(Lines);
  }
}
