using System.Collections.Generic; using System.Globalization; using System.Reflection; using System.Text.RegularExpressions; using UnityEngine;
using UnityEngine.Rendering; using UnityEngine.Rendering.HighDefinition; using UnityEngine.Experimental.Rendering;

class ScatterPass : CustomPass
{
    public Material material;
    public TextAsset table;
    public float distance = 0.6f; // metres, of the head
    static readonly Regex Row = new Regex(
        @"^// (SSS_\w+)(?:\((\d+)(?:, (x|y|[\d.]+ deg))?\))? +(.+?) {2,}(\w+) +1(?:/(\d+))? +\d+\r?$", RegexOptions.Multiline);
    static readonly Regex List = new Regex(@"^// call .*\n((?:// .* \d+\r?\n)*)", RegexOptions.Multiline);
    static readonly Regex Other = new Regex(@"uint (?:frame|profile)\b|float2 mm_per_pixel|\bD0\b");
    readonly Dictionary<string, RTHandle> pictures = new Dictionary<string, RTHandle>();

    static RTHandle Internal(CustomPassContext ctx, string field) => (RTHandle)typeof(CustomPassContext)
        .GetField(field, BindingFlags.Instance | BindingFlags.NonPublic).GetValue(ctx);

    static MatchCollection Passes(string source)
    {
        string list = List.Match(source).Groups[1].Value;
        MatchCollection rows = Row.Matches(list);
        if (rows.Count > 0 && rows.Count == list.Split('\n').Length - 1 && !Other.IsMatch(source)) return rows;
        throw new System.NotSupportedException("ScatterPass cannot draw this export; docs/integrate.md says which it can.");
    }

    static Vector2 Along(string axis)
    {
        if (!axis.EndsWith("deg")) return axis == "x" ? Vector2.right : Vector2.up;
        float angle = float.Parse(axis.Split(' ')[0], CultureInfo.InvariantCulture) * Mathf.Deg2Rad;
        return new Vector2(Mathf.Cos(angle), Mathf.Sin(angle));
    }

    protected override void Execute(CustomPassContext ctx)
    {
        RTHandle light = Internal(ctx, "diffuseLightingBuffer");
        ctx.propertyBlock.SetTexture("Lit", light);
        ctx.propertyBlock.SetTexture("SkinColor", Internal(ctx, "sssBuffer"));
        float tangent = Mathf.Tan(ctx.hdCamera.camera.fieldOfView * Mathf.Deg2Rad / 2);
        ctx.propertyBlock.SetFloat("Mm", 2000 * distance * tangent / ctx.hdCamera.actualHeight);
        Draw(ctx, "Light", Picture(ctx, "E", 1));
        foreach (Match row in Passes(table.text))
        {
            string[] reads = row.Groups[4].Value.Split(' ');
            for (int k = 0; k < reads.Length; k++) ctx.propertyBlock.SetTexture("T" + k, pictures[reads[k]]);
            ctx.propertyBlock.SetVector("Axis", Along(row.Groups[3].Value));
            ctx.propertyBlock.SetFloat("Stage", row.Groups[2].Success ? int.Parse(row.Groups[2].Value) : 0);
            int size = row.Groups[6].Success ? int.Parse(row.Groups[6].Value) : 1;
            Draw(ctx, row.Groups[1].Value.Substring(4), Picture(ctx, row.Groups[5].Value, size));
        }
        ctx.propertyBlock.SetTexture("T0", pictures["M0"]);
        Draw(ctx, "Add", ctx.cameraColorBuffer);
        CoreUtils.SetRenderTarget(ctx.cmd, light, ClearFlag.Color); // HDRP's own blur then adds nothing
    }

    void Draw(CustomPassContext ctx, string pass, RTHandle target)
    {
        int number = material.FindPass(pass);
        if (number < 0) throw new System.MissingMemberException($"the shader has no Pass {pass}, which the export asks for.");
        CoreUtils.SetRenderTarget(ctx.cmd, target);
        CoreUtils.DrawFullScreen(ctx.cmd, material, ctx.propertyBlock, number);
    }

    RTHandle Picture(CustomPassContext ctx, string name, int size)
    {
        int width = (ctx.hdCamera.actualWidth + size - 1) / size, height = (ctx.hdCamera.actualHeight + size - 1) / size;
        if (pictures.TryGetValue(name, out RTHandle made) && made.rt.width == width && made.rt.height == height) return made;
        made?.Release();
        return pictures[name] = RTHandles.Alloc(width, height, colorFormat: GraphicsFormat.R16G16B16A16_SFloat,
            filterMode: FilterMode.Bilinear, wrapMode: TextureWrapMode.Clamp, name: name);
    }

    protected override void Cleanup() { foreach (RTHandle each in pictures.Values) each.Release(); pictures.Clear(); }
}
