<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis simplifyDrawingTol="1" labelsEnabled="1" simplifyLocal="1" simplifyDrawingHints="1" simplifyAlgorithm="0" simplifyMaxScale="1" symbologyReferenceScale="-1" minScale="100000000" version="3.22.16-Białowieża" styleCategories="LayerConfiguration|Symbology|Labeling|Fields|Forms|MapTips|AttributeTable|Rendering" hasScaleBasedVisibilityFlag="0" maxScale="0" readOnly="0">
  <flags>
    <Identifiable>1</Identifiable>
    <Removable>1</Removable>
    <Searchable>1</Searchable>
    <Private>0</Private>
  </flags>
  <renderer-v2 type="categorizedSymbol" referencescale="-1" enableorderby="0" attr="CASE WHEN &quot;rev_flag&quot; IN ('reject', 'merge') THEN 'out' WHEN &quot;rev_dbh_cm&quot; IS NOT NULL THEN 'decided' WHEN &quot;rev_flag&quot; = 'accept' AND &quot;dbh_cm&quot; IS NOT NULL THEN 'decided' WHEN &quot;rev_flag&quot; IN ('accept', 'stem') THEN 'stem' ELSE &quot;qc_flag&quot; END" forceraster="0" symbollevels="0">
    <categories>
      <category symbol="0" value="ok" render="true" label="measured"/>
      <category symbol="1" value="check" render="true" label="measured, to be checked"/>
      <category symbol="2" value="reject" render="true" label="seen, no DBH"/>
      <category symbol="3" value="decided" render="true" label="by hand: accepted, taped"/>
      <category symbol="4" value="stem" render="true" label="by hand: no DBH"/>
      <category symbol="5" value="out" render="true" label="by hand: no tree"/>
      <category symbol="6" value="outside" render="true" label="pale: outside the plots"/>
    </categories>
    <symbols>
      <symbol type="marker" force_rhr="0" clip_to_extent="1" alpha="1" name="0">
        <data_defined_properties>
          <Option type="Map">
            <Option type="QString" name="name" value=""/>
            <Option type="Map" name="properties">
              <Option type="Map" name="alpha">
                <Option type="bool" name="active" value="true"/>
                <Option type="QString" name="expression" value="if((coalesce(&quot;plot_id&quot;, '') = '' AND coalesce(maximum(&quot;plot_id&quot;), '') &lt;> ''), 65, 100)"/>
                <Option type="int" name="type" value="3"/>
              </Option>
            </Option>
            <Option type="QString" name="type" value="collection"/>
          </Option>
        </data_defined_properties>
        <layer class="SimpleMarker" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="angle" value="0"/>
            <Option type="QString" name="cap_style" value="square"/>
            <Option type="QString" name="color" value="46,139,61,255"/>
            <Option type="QString" name="horizontal_anchor_point" value="1"/>
            <Option type="QString" name="joinstyle" value="bevel"/>
            <Option type="QString" name="name" value="circle"/>
            <Option type="QString" name="offset" value="0,0"/>
            <Option type="QString" name="offset_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="offset_unit" value="MM"/>
            <Option type="QString" name="outline_color" value="18,64,26,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.3"/>
            <Option type="QString" name="outline_width_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="scale_method" value="diameter"/>
            <Option type="QString" name="size" value="2"/>
            <Option type="QString" name="size_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="size_unit" value="MM"/>
            <Option type="QString" name="vertical_anchor_point" value="1"/>
          </Option>
          <prop k="angle" v="0"/>
          <prop k="cap_style" v="square"/>
          <prop k="color" v="46,139,61,255"/>
          <prop k="horizontal_anchor_point" v="1"/>
          <prop k="joinstyle" v="bevel"/>
          <prop k="name" v="circle"/>
          <prop k="offset" v="0,0"/>
          <prop k="offset_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="offset_unit" v="MM"/>
          <prop k="outline_color" v="18,64,26,255"/>
          <prop k="outline_style" v="solid"/>
          <prop k="outline_width" v="0.3"/>
          <prop k="outline_width_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="outline_width_unit" v="MM"/>
          <prop k="scale_method" v="diameter"/>
          <prop k="size" v="2"/>
          <prop k="size_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="size_unit" v="MM"/>
          <prop k="vertical_anchor_point" v="1"/>
          <data_defined_properties>
            <Option type="Map">
              <Option type="QString" name="name" value=""/>
              <Option type="Map" name="properties">
                <Option type="Map" name="fillColor">
                  <Option type="bool" name="active" value="true"/>
                  <Option type="QString" name="expression" value="if((coalesce(&quot;plot_id&quot;, '') = '' AND coalesce(maximum(&quot;plot_id&quot;), '') &lt;> ''), '#ffffff', '46,139,61,255')"/>
                  <Option type="int" name="type" value="3"/>
                </Option>
                <Option type="Map" name="outlineColor">
                  <Option type="bool" name="active" value="true"/>
                  <Option type="QString" name="expression" value="if((coalesce(&quot;plot_id&quot;, '') = '' AND coalesce(maximum(&quot;plot_id&quot;), '') &lt;> ''), '#2e8b3d', '#12401a')"/>
                  <Option type="int" name="type" value="3"/>
                </Option>
                <Option type="Map" name="size">
                  <Option type="bool" name="active" value="true"/>
                  <Option type="QString" name="expression" value="max(coalesce(&quot;dbh_cm&quot;, 0) * 10 / @map_scale, 1.4 + coalesce(&quot;dbh_cm&quot;, 15) * 0.05)"/>
                  <Option type="int" name="type" value="3"/>
                </Option>
              </Option>
              <Option type="QString" name="type" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
      <symbol type="marker" force_rhr="0" clip_to_extent="1" alpha="1" name="1">
        <data_defined_properties>
          <Option type="Map">
            <Option type="QString" name="name" value=""/>
            <Option type="Map" name="properties">
              <Option type="Map" name="alpha">
                <Option type="bool" name="active" value="true"/>
                <Option type="QString" name="expression" value="if((coalesce(&quot;plot_id&quot;, '') = '' AND coalesce(maximum(&quot;plot_id&quot;), '') &lt;> ''), 65, 100)"/>
                <Option type="int" name="type" value="3"/>
              </Option>
            </Option>
            <Option type="QString" name="type" value="collection"/>
          </Option>
        </data_defined_properties>
        <layer class="SimpleMarker" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="angle" value="0"/>
            <Option type="QString" name="cap_style" value="square"/>
            <Option type="QString" name="color" value="242,161,13,255"/>
            <Option type="QString" name="horizontal_anchor_point" value="1"/>
            <Option type="QString" name="joinstyle" value="bevel"/>
            <Option type="QString" name="name" value="circle"/>
            <Option type="QString" name="offset" value="0,0"/>
            <Option type="QString" name="offset_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="offset_unit" value="MM"/>
            <Option type="QString" name="outline_color" value="122,75,0,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.3"/>
            <Option type="QString" name="outline_width_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="scale_method" value="diameter"/>
            <Option type="QString" name="size" value="2"/>
            <Option type="QString" name="size_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="size_unit" value="MM"/>
            <Option type="QString" name="vertical_anchor_point" value="1"/>
          </Option>
          <prop k="angle" v="0"/>
          <prop k="cap_style" v="square"/>
          <prop k="color" v="242,161,13,255"/>
          <prop k="horizontal_anchor_point" v="1"/>
          <prop k="joinstyle" v="bevel"/>
          <prop k="name" v="circle"/>
          <prop k="offset" v="0,0"/>
          <prop k="offset_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="offset_unit" v="MM"/>
          <prop k="outline_color" v="122,75,0,255"/>
          <prop k="outline_style" v="solid"/>
          <prop k="outline_width" v="0.3"/>
          <prop k="outline_width_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="outline_width_unit" v="MM"/>
          <prop k="scale_method" v="diameter"/>
          <prop k="size" v="2"/>
          <prop k="size_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="size_unit" v="MM"/>
          <prop k="vertical_anchor_point" v="1"/>
          <data_defined_properties>
            <Option type="Map">
              <Option type="QString" name="name" value=""/>
              <Option type="Map" name="properties">
                <Option type="Map" name="fillColor">
                  <Option type="bool" name="active" value="true"/>
                  <Option type="QString" name="expression" value="if((coalesce(&quot;plot_id&quot;, '') = '' AND coalesce(maximum(&quot;plot_id&quot;), '') &lt;> ''), '#ffffff', '242,161,13,255')"/>
                  <Option type="int" name="type" value="3"/>
                </Option>
                <Option type="Map" name="outlineColor">
                  <Option type="bool" name="active" value="true"/>
                  <Option type="QString" name="expression" value="if((coalesce(&quot;plot_id&quot;, '') = '' AND coalesce(maximum(&quot;plot_id&quot;), '') &lt;> ''), '#f2a10d', '#7a4b00')"/>
                  <Option type="int" name="type" value="3"/>
                </Option>
                <Option type="Map" name="size">
                  <Option type="bool" name="active" value="true"/>
                  <Option type="QString" name="expression" value="max(coalesce(&quot;dbh_cm&quot;, 0) * 10 / @map_scale, 1.4 + coalesce(&quot;dbh_cm&quot;, 15) * 0.05)"/>
                  <Option type="int" name="type" value="3"/>
                </Option>
              </Option>
              <Option type="QString" name="type" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
      <symbol type="marker" force_rhr="0" clip_to_extent="1" alpha="1" name="2">
        <data_defined_properties>
          <Option type="Map">
            <Option type="QString" name="name" value=""/>
            <Option type="Map" name="properties">
              <Option type="Map" name="alpha">
                <Option type="bool" name="active" value="true"/>
                <Option type="QString" name="expression" value="if((coalesce(&quot;plot_id&quot;, '') = '' AND coalesce(maximum(&quot;plot_id&quot;), '') &lt;> ''), 65, 100)"/>
                <Option type="int" name="type" value="3"/>
              </Option>
            </Option>
            <Option type="QString" name="type" value="collection"/>
          </Option>
        </data_defined_properties>
        <layer class="SimpleMarker" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="angle" value="0"/>
            <Option type="QString" name="cap_style" value="square"/>
            <Option type="QString" name="color" value="255,255,255,0"/>
            <Option type="QString" name="horizontal_anchor_point" value="1"/>
            <Option type="QString" name="joinstyle" value="bevel"/>
            <Option type="QString" name="name" value="circle"/>
            <Option type="QString" name="offset" value="0,0"/>
            <Option type="QString" name="offset_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="offset_unit" value="MM"/>
            <Option type="QString" name="outline_color" value="198,40,40,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.5"/>
            <Option type="QString" name="outline_width_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="scale_method" value="diameter"/>
            <Option type="QString" name="size" value="2"/>
            <Option type="QString" name="size_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="size_unit" value="MM"/>
            <Option type="QString" name="vertical_anchor_point" value="1"/>
          </Option>
          <prop k="angle" v="0"/>
          <prop k="cap_style" v="square"/>
          <prop k="color" v="255,255,255,0"/>
          <prop k="horizontal_anchor_point" v="1"/>
          <prop k="joinstyle" v="bevel"/>
          <prop k="name" v="circle"/>
          <prop k="offset" v="0,0"/>
          <prop k="offset_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="offset_unit" v="MM"/>
          <prop k="outline_color" v="198,40,40,255"/>
          <prop k="outline_style" v="solid"/>
          <prop k="outline_width" v="0.5"/>
          <prop k="outline_width_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="outline_width_unit" v="MM"/>
          <prop k="scale_method" v="diameter"/>
          <prop k="size" v="2"/>
          <prop k="size_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="size_unit" v="MM"/>
          <prop k="vertical_anchor_point" v="1"/>
          <data_defined_properties>
            <Option type="Map">
              <Option type="QString" name="name" value=""/>
              <Option type="Map" name="properties">
                <Option type="Map" name="fillColor">
                  <Option type="bool" name="active" value="true"/>
                  <Option type="QString" name="expression" value="if((coalesce(&quot;plot_id&quot;, '') = '' AND coalesce(maximum(&quot;plot_id&quot;), '') &lt;> ''), '#ffffff', '255,255,255,0')"/>
                  <Option type="int" name="type" value="3"/>
                </Option>
                <Option type="Map" name="outlineColor">
                  <Option type="bool" name="active" value="true"/>
                  <Option type="QString" name="expression" value="if((coalesce(&quot;plot_id&quot;, '') = '' AND coalesce(maximum(&quot;plot_id&quot;), '') &lt;> ''), '#c62828', '#c62828')"/>
                  <Option type="int" name="type" value="3"/>
                </Option>
                <Option type="Map" name="size">
                  <Option type="bool" name="active" value="true"/>
                  <Option type="QString" name="expression" value="2.6"/>
                  <Option type="int" name="type" value="3"/>
                </Option>
              </Option>
              <Option type="QString" name="type" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
      <symbol type="marker" force_rhr="0" clip_to_extent="1" alpha="1" name="3">
        <data_defined_properties>
          <Option type="Map">
            <Option type="QString" name="name" value=""/>
            <Option type="Map" name="properties">
              <Option type="Map" name="alpha">
                <Option type="bool" name="active" value="true"/>
                <Option type="QString" name="expression" value="if((coalesce(&quot;plot_id&quot;, '') = '' AND coalesce(maximum(&quot;plot_id&quot;), '') &lt;> ''), 65, 100)"/>
                <Option type="int" name="type" value="3"/>
              </Option>
            </Option>
            <Option type="QString" name="type" value="collection"/>
          </Option>
        </data_defined_properties>
        <layer class="SimpleMarker" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="angle" value="0"/>
            <Option type="QString" name="cap_style" value="square"/>
            <Option type="QString" name="color" value="46,139,61,255"/>
            <Option type="QString" name="horizontal_anchor_point" value="1"/>
            <Option type="QString" name="joinstyle" value="bevel"/>
            <Option type="QString" name="name" value="circle"/>
            <Option type="QString" name="offset" value="0,0"/>
            <Option type="QString" name="offset_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="offset_unit" value="MM"/>
            <Option type="QString" name="outline_color" value="31,78,156,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.7"/>
            <Option type="QString" name="outline_width_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="scale_method" value="diameter"/>
            <Option type="QString" name="size" value="2"/>
            <Option type="QString" name="size_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="size_unit" value="MM"/>
            <Option type="QString" name="vertical_anchor_point" value="1"/>
          </Option>
          <prop k="angle" v="0"/>
          <prop k="cap_style" v="square"/>
          <prop k="color" v="46,139,61,255"/>
          <prop k="horizontal_anchor_point" v="1"/>
          <prop k="joinstyle" v="bevel"/>
          <prop k="name" v="circle"/>
          <prop k="offset" v="0,0"/>
          <prop k="offset_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="offset_unit" v="MM"/>
          <prop k="outline_color" v="31,78,156,255"/>
          <prop k="outline_style" v="solid"/>
          <prop k="outline_width" v="0.7"/>
          <prop k="outline_width_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="outline_width_unit" v="MM"/>
          <prop k="scale_method" v="diameter"/>
          <prop k="size" v="2"/>
          <prop k="size_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="size_unit" v="MM"/>
          <prop k="vertical_anchor_point" v="1"/>
          <data_defined_properties>
            <Option type="Map">
              <Option type="QString" name="name" value=""/>
              <Option type="Map" name="properties">
                <Option type="Map" name="fillColor">
                  <Option type="bool" name="active" value="true"/>
                  <Option type="QString" name="expression" value="if((coalesce(&quot;plot_id&quot;, '') = '' AND coalesce(maximum(&quot;plot_id&quot;), '') &lt;> ''), '#ffffff', '46,139,61,255')"/>
                  <Option type="int" name="type" value="3"/>
                </Option>
                <Option type="Map" name="outlineColor">
                  <Option type="bool" name="active" value="true"/>
                  <Option type="QString" name="expression" value="if((coalesce(&quot;plot_id&quot;, '') = '' AND coalesce(maximum(&quot;plot_id&quot;), '') &lt;> ''), '#1f4e9c', '#1f4e9c')"/>
                  <Option type="int" name="type" value="3"/>
                </Option>
                <Option type="Map" name="size">
                  <Option type="bool" name="active" value="true"/>
                  <Option type="QString" name="expression" value="max(coalesce(coalesce(&quot;rev_dbh_cm&quot;, &quot;dbh_cm&quot;), 0) * 10 / @map_scale, 1.4 + coalesce(coalesce(&quot;rev_dbh_cm&quot;, &quot;dbh_cm&quot;), 15) * 0.05)"/>
                  <Option type="int" name="type" value="3"/>
                </Option>
              </Option>
              <Option type="QString" name="type" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
      <symbol type="marker" force_rhr="0" clip_to_extent="1" alpha="1" name="4">
        <data_defined_properties>
          <Option type="Map">
            <Option type="QString" name="name" value=""/>
            <Option type="Map" name="properties">
              <Option type="Map" name="alpha">
                <Option type="bool" name="active" value="true"/>
                <Option type="QString" name="expression" value="if((coalesce(&quot;plot_id&quot;, '') = '' AND coalesce(maximum(&quot;plot_id&quot;), '') &lt;> ''), 65, 100)"/>
                <Option type="int" name="type" value="3"/>
              </Option>
            </Option>
            <Option type="QString" name="type" value="collection"/>
          </Option>
        </data_defined_properties>
        <layer class="SimpleMarker" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="angle" value="0"/>
            <Option type="QString" name="cap_style" value="square"/>
            <Option type="QString" name="color" value="255,255,255,0"/>
            <Option type="QString" name="horizontal_anchor_point" value="1"/>
            <Option type="QString" name="joinstyle" value="bevel"/>
            <Option type="QString" name="name" value="circle"/>
            <Option type="QString" name="offset" value="0,0"/>
            <Option type="QString" name="offset_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="offset_unit" value="MM"/>
            <Option type="QString" name="outline_color" value="31,78,156,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.7"/>
            <Option type="QString" name="outline_width_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="scale_method" value="diameter"/>
            <Option type="QString" name="size" value="2"/>
            <Option type="QString" name="size_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="size_unit" value="MM"/>
            <Option type="QString" name="vertical_anchor_point" value="1"/>
          </Option>
          <prop k="angle" v="0"/>
          <prop k="cap_style" v="square"/>
          <prop k="color" v="255,255,255,0"/>
          <prop k="horizontal_anchor_point" v="1"/>
          <prop k="joinstyle" v="bevel"/>
          <prop k="name" v="circle"/>
          <prop k="offset" v="0,0"/>
          <prop k="offset_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="offset_unit" v="MM"/>
          <prop k="outline_color" v="31,78,156,255"/>
          <prop k="outline_style" v="solid"/>
          <prop k="outline_width" v="0.7"/>
          <prop k="outline_width_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="outline_width_unit" v="MM"/>
          <prop k="scale_method" v="diameter"/>
          <prop k="size" v="2"/>
          <prop k="size_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="size_unit" v="MM"/>
          <prop k="vertical_anchor_point" v="1"/>
          <data_defined_properties>
            <Option type="Map">
              <Option type="QString" name="name" value=""/>
              <Option type="Map" name="properties">
                <Option type="Map" name="fillColor">
                  <Option type="bool" name="active" value="true"/>
                  <Option type="QString" name="expression" value="if((coalesce(&quot;plot_id&quot;, '') = '' AND coalesce(maximum(&quot;plot_id&quot;), '') &lt;> ''), '#ffffff', '255,255,255,0')"/>
                  <Option type="int" name="type" value="3"/>
                </Option>
                <Option type="Map" name="outlineColor">
                  <Option type="bool" name="active" value="true"/>
                  <Option type="QString" name="expression" value="if((coalesce(&quot;plot_id&quot;, '') = '' AND coalesce(maximum(&quot;plot_id&quot;), '') &lt;> ''), '#1f4e9c', '#1f4e9c')"/>
                  <Option type="int" name="type" value="3"/>
                </Option>
                <Option type="Map" name="size">
                  <Option type="bool" name="active" value="true"/>
                  <Option type="QString" name="expression" value="2.6"/>
                  <Option type="int" name="type" value="3"/>
                </Option>
              </Option>
              <Option type="QString" name="type" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
      <symbol type="marker" force_rhr="0" clip_to_extent="1" alpha="1" name="5">
        <data_defined_properties>
          <Option type="Map">
            <Option type="QString" name="name" value=""/>
            <Option type="Map" name="properties">
              <Option type="Map" name="alpha">
                <Option type="bool" name="active" value="true"/>
                <Option type="QString" name="expression" value="if((coalesce(&quot;plot_id&quot;, '') = '' AND coalesce(maximum(&quot;plot_id&quot;), '') &lt;> ''), 65, 100)"/>
                <Option type="int" name="type" value="3"/>
              </Option>
            </Option>
            <Option type="QString" name="type" value="collection"/>
          </Option>
        </data_defined_properties>
        <layer class="SimpleMarker" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="angle" value="0"/>
            <Option type="QString" name="cap_style" value="square"/>
            <Option type="QString" name="color" value="255,0,0,255"/>
            <Option type="QString" name="horizontal_anchor_point" value="1"/>
            <Option type="QString" name="joinstyle" value="bevel"/>
            <Option type="QString" name="name" value="cross2"/>
            <Option type="QString" name="offset" value="0,0"/>
            <Option type="QString" name="offset_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="offset_unit" value="MM"/>
            <Option type="QString" name="outline_color" value="255,255,255,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="1.3"/>
            <Option type="QString" name="outline_width_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="scale_method" value="diameter"/>
            <Option type="QString" name="size" value="2"/>
            <Option type="QString" name="size_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="size_unit" value="MM"/>
            <Option type="QString" name="vertical_anchor_point" value="1"/>
          </Option>
          <prop k="angle" v="0"/>
          <prop k="cap_style" v="square"/>
          <prop k="color" v="255,0,0,255"/>
          <prop k="horizontal_anchor_point" v="1"/>
          <prop k="joinstyle" v="bevel"/>
          <prop k="name" v="cross2"/>
          <prop k="offset" v="0,0"/>
          <prop k="offset_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="offset_unit" v="MM"/>
          <prop k="outline_color" v="255,255,255,255"/>
          <prop k="outline_style" v="solid"/>
          <prop k="outline_width" v="1.3"/>
          <prop k="outline_width_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="outline_width_unit" v="MM"/>
          <prop k="scale_method" v="diameter"/>
          <prop k="size" v="2"/>
          <prop k="size_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="size_unit" v="MM"/>
          <prop k="vertical_anchor_point" v="1"/>
          <data_defined_properties>
            <Option type="Map">
              <Option type="QString" name="name" value=""/>
              <Option type="Map" name="properties">
                <Option type="Map" name="fillColor">
                  <Option type="bool" name="active" value="true"/>
                  <Option type="QString" name="expression" value="if((coalesce(&quot;plot_id&quot;, '') = '' AND coalesce(maximum(&quot;plot_id&quot;), '') &lt;> ''), '#ffffff', '255,0,0,255')"/>
                  <Option type="int" name="type" value="3"/>
                </Option>
                <Option type="Map" name="outlineColor">
                  <Option type="bool" name="active" value="true"/>
                  <Option type="QString" name="expression" value="if((coalesce(&quot;plot_id&quot;, '') = '' AND coalesce(maximum(&quot;plot_id&quot;), '') &lt;> ''), '#ffffff', '#ffffff')"/>
                  <Option type="int" name="type" value="3"/>
                </Option>
                <Option type="Map" name="size">
                  <Option type="bool" name="active" value="true"/>
                  <Option type="QString" name="expression" value="2.6"/>
                  <Option type="int" name="type" value="3"/>
                </Option>
              </Option>
              <Option type="QString" name="type" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
        <layer class="SimpleMarker" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="angle" value="0"/>
            <Option type="QString" name="cap_style" value="square"/>
            <Option type="QString" name="color" value="255,0,0,255"/>
            <Option type="QString" name="horizontal_anchor_point" value="1"/>
            <Option type="QString" name="joinstyle" value="bevel"/>
            <Option type="QString" name="name" value="cross2"/>
            <Option type="QString" name="offset" value="0,0"/>
            <Option type="QString" name="offset_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="offset_unit" value="MM"/>
            <Option type="QString" name="outline_color" value="122,122,122,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.5"/>
            <Option type="QString" name="outline_width_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="scale_method" value="diameter"/>
            <Option type="QString" name="size" value="2"/>
            <Option type="QString" name="size_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="size_unit" value="MM"/>
            <Option type="QString" name="vertical_anchor_point" value="1"/>
          </Option>
          <prop k="angle" v="0"/>
          <prop k="cap_style" v="square"/>
          <prop k="color" v="255,0,0,255"/>
          <prop k="horizontal_anchor_point" v="1"/>
          <prop k="joinstyle" v="bevel"/>
          <prop k="name" v="cross2"/>
          <prop k="offset" v="0,0"/>
          <prop k="offset_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="offset_unit" v="MM"/>
          <prop k="outline_color" v="122,122,122,255"/>
          <prop k="outline_style" v="solid"/>
          <prop k="outline_width" v="0.5"/>
          <prop k="outline_width_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="outline_width_unit" v="MM"/>
          <prop k="scale_method" v="diameter"/>
          <prop k="size" v="2"/>
          <prop k="size_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="size_unit" v="MM"/>
          <prop k="vertical_anchor_point" v="1"/>
          <data_defined_properties>
            <Option type="Map">
              <Option type="QString" name="name" value=""/>
              <Option type="Map" name="properties">
                <Option type="Map" name="size">
                  <Option type="bool" name="active" value="true"/>
                  <Option type="QString" name="expression" value="2.6"/>
                  <Option type="int" name="type" value="3"/>
                </Option>
              </Option>
              <Option type="QString" name="type" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
      <symbol type="marker" force_rhr="0" clip_to_extent="1" alpha="0.65" name="6">
        <data_defined_properties>
          <Option type="Map">
            <Option type="QString" name="name" value=""/>
            <Option name="properties"/>
            <Option type="QString" name="type" value="collection"/>
          </Option>
        </data_defined_properties>
        <layer class="SimpleMarker" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="angle" value="0"/>
            <Option type="QString" name="cap_style" value="square"/>
            <Option type="QString" name="color" value="255,255,255,255"/>
            <Option type="QString" name="horizontal_anchor_point" value="1"/>
            <Option type="QString" name="joinstyle" value="bevel"/>
            <Option type="QString" name="name" value="circle"/>
            <Option type="QString" name="offset" value="0,0"/>
            <Option type="QString" name="offset_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="offset_unit" value="MM"/>
            <Option type="QString" name="outline_color" value="46,139,61,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.3"/>
            <Option type="QString" name="outline_width_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="scale_method" value="diameter"/>
            <Option type="QString" name="size" value="2"/>
            <Option type="QString" name="size_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="size_unit" value="MM"/>
            <Option type="QString" name="vertical_anchor_point" value="1"/>
          </Option>
          <prop k="angle" v="0"/>
          <prop k="cap_style" v="square"/>
          <prop k="color" v="255,255,255,255"/>
          <prop k="horizontal_anchor_point" v="1"/>
          <prop k="joinstyle" v="bevel"/>
          <prop k="name" v="circle"/>
          <prop k="offset" v="0,0"/>
          <prop k="offset_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="offset_unit" v="MM"/>
          <prop k="outline_color" v="46,139,61,255"/>
          <prop k="outline_style" v="solid"/>
          <prop k="outline_width" v="0.3"/>
          <prop k="outline_width_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="outline_width_unit" v="MM"/>
          <prop k="scale_method" v="diameter"/>
          <prop k="size" v="2"/>
          <prop k="size_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="size_unit" v="MM"/>
          <prop k="vertical_anchor_point" v="1"/>
          <data_defined_properties>
            <Option type="Map">
              <Option type="QString" name="name" value=""/>
              <Option type="Map" name="properties">
                <Option type="Map" name="size">
                  <Option type="bool" name="active" value="true"/>
                  <Option type="QString" name="expression" value="2.6"/>
                  <Option type="int" name="type" value="3"/>
                </Option>
              </Option>
              <Option type="QString" name="type" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
    </symbols>
    <rotation/>
    <sizescale/>
  </renderer-v2>
  <labeling type="simple">
    <settings calloutType="simple">
      <text-style fieldName="coalesce(format_number(round(CASE WHEN &quot;rev_flag&quot; IN ('reject', 'merge', 'stem') THEN NULL ELSE coalesce(&quot;rev_dbh_cm&quot;, &quot;dbh_cm&quot;) END, 1), 1), &quot;tree_id&quot;)" fontWeight="50" useSubstitutions="0" capitalization="0" fontSizeMapUnitScale="3x:0,0,0,0,0,0" textOrientation="horizontal" legendString="Aa" textColor="27,27,27,255" fontSize="8" fontUnderline="0" fontStrikeout="0" fontLetterSpacing="0" textOpacity="1" blendMode="0" fontItalic="0" fontWordSpacing="0" fontSizeUnit="Point" previewBkgrdColor="255,255,255,255" fontKerning="1" fontFamily="Sans" allowHtml="0" isExpression="1" namedStyle="" multilineHeight="1">
        <families/>
        <text-buffer bufferJoinStyle="128" bufferSize="0.69999999999999996" bufferSizeMapUnitScale="3x:0,0,0,0,0,0" bufferDraw="1" bufferBlendMode="0" bufferNoFill="1" bufferColor="255,255,255,255" bufferOpacity="1" bufferSizeUnits="MM"/>
        <text-mask maskOpacity="1" maskedSymbolLayers="" maskSizeUnits="MM" maskJoinStyle="128" maskType="0" maskSizeMapUnitScale="3x:0,0,0,0,0,0" maskEnabled="0" maskSize="1.5"/>
        <background shapeDraw="0" shapeRadiiX="0" shapeOpacity="1" shapeRadiiY="0" shapeOffsetMapUnitScale="3x:0,0,0,0,0,0" shapeFillColor="255,255,255,255" shapeBorderWidth="0" shapeSizeMapUnitScale="3x:0,0,0,0,0,0" shapeRadiiMapUnitScale="3x:0,0,0,0,0,0" shapeBorderWidthUnit="MM" shapeRotationType="0" shapeSVGFile="" shapeJoinStyle="64" shapeBorderColor="128,128,128,255" shapeBorderWidthMapUnitScale="3x:0,0,0,0,0,0" shapeRotation="0" shapeType="0" shapeOffsetUnit="MM" shapeRadiiUnit="MM" shapeOffsetX="0" shapeSizeX="0" shapeOffsetY="0" shapeSizeY="0" shapeBlendMode="0" shapeSizeUnit="MM" shapeSizeType="0">
          <symbol type="fill" force_rhr="0" clip_to_extent="1" alpha="1" name="fillSymbol">
            <data_defined_properties>
              <Option type="Map">
                <Option type="QString" name="name" value=""/>
                <Option name="properties"/>
                <Option type="QString" name="type" value="collection"/>
              </Option>
            </data_defined_properties>
            <layer class="SimpleFill" enabled="1" locked="0" pass="0">
              <Option type="Map">
                <Option type="QString" name="border_width_map_unit_scale" value="3x:0,0,0,0,0,0"/>
                <Option type="QString" name="color" value="255,255,255,255"/>
                <Option type="QString" name="joinstyle" value="bevel"/>
                <Option type="QString" name="offset" value="0,0"/>
                <Option type="QString" name="offset_map_unit_scale" value="3x:0,0,0,0,0,0"/>
                <Option type="QString" name="offset_unit" value="MM"/>
                <Option type="QString" name="outline_color" value="128,128,128,255"/>
                <Option type="QString" name="outline_style" value="no"/>
                <Option type="QString" name="outline_width" value="0"/>
                <Option type="QString" name="outline_width_unit" value="MM"/>
                <Option type="QString" name="style" value="solid"/>
              </Option>
              <prop k="border_width_map_unit_scale" v="3x:0,0,0,0,0,0"/>
              <prop k="color" v="255,255,255,255"/>
              <prop k="joinstyle" v="bevel"/>
              <prop k="offset" v="0,0"/>
              <prop k="offset_map_unit_scale" v="3x:0,0,0,0,0,0"/>
              <prop k="offset_unit" v="MM"/>
              <prop k="outline_color" v="128,128,128,255"/>
              <prop k="outline_style" v="no"/>
              <prop k="outline_width" v="0"/>
              <prop k="outline_width_unit" v="MM"/>
              <prop k="style" v="solid"/>
              <data_defined_properties>
                <Option type="Map">
                  <Option type="QString" name="name" value=""/>
                  <Option name="properties"/>
                  <Option type="QString" name="type" value="collection"/>
                </Option>
              </data_defined_properties>
            </layer>
          </symbol>
        </background>
        <shadow shadowRadiusMapUnitScale="3x:0,0,0,0,0,0" shadowRadiusAlphaOnly="0" shadowOffsetUnit="MM" shadowOffsetGlobal="1" shadowUnder="0" shadowOpacity="0.69999999999999996" shadowColor="0,0,0,255" shadowDraw="0" shadowOffsetMapUnitScale="3x:0,0,0,0,0,0" shadowRadius="1.5" shadowScale="100" shadowOffsetAngle="135" shadowBlendMode="6" shadowOffsetDist="1" shadowRadiusUnit="MM"/>
        <dd_properties>
          <Option type="Map">
            <Option type="QString" name="name" value=""/>
            <Option name="properties"/>
            <Option type="QString" name="type" value="collection"/>
          </Option>
        </dd_properties>
        <substitutions/>
      </text-style>
      <text-format placeDirectionSymbol="0" plussign="0" formatNumbers="0" rightDirectionSymbol=">" multilineAlign="3" reverseDirectionSymbol="0" useMaxLineLengthForAutoWrap="1" decimals="3" wrapChar="" autoWrapLength="0" leftDirectionSymbol="&lt;" addDirectionSymbol="0"/>
      <placement placementFlags="10" rotationUnit="AngleDegrees" rotationAngle="0" yOffset="0" xOffset="0" overrunDistanceMapUnitScale="3x:0,0,0,0,0,0" overrunDistance="0" geometryGeneratorEnabled="0" layerType="UnknownGeometry" labelOffsetMapUnitScale="3x:0,0,0,0,0,0" lineAnchorClipping="0" placement="6" repeatDistanceMapUnitScale="3x:0,0,0,0,0,0" lineAnchorPercent="0.5" geometryGenerator="" maxCurvedCharAngleIn="25" geometryGeneratorType="PointGeometry" preserveRotation="1" distMapUnitScale="3x:0,0,0,0,0,0" quadOffset="4" centroidInside="0" maxCurvedCharAngleOut="-25" overrunDistanceUnit="MM" polygonPlacementFlags="2" distUnits="MM" predefinedPositionOrder="TR,TL,BR,BL,R,L,TSR,BSR" lineAnchorType="0" offsetType="1" repeatDistanceUnits="MM" repeatDistance="0" fitInPolygonOnly="0" centroidWhole="0" dist="0.59999999999999998" offsetUnits="MM" priority="5"/>
      <rendering upsidedownLabels="0" unplacedVisibility="0" obstacleType="1" displayAll="0" scaleMin="0" zIndex="0" scaleVisibility="1" minFeatureSize="0" fontLimitPixelSize="0" drawLabels="1" limitNumLabels="0" labelPerPart="0" maxNumLabels="2000" obstacle="1" fontMaxPixelSize="10000" scaleMax="3000" obstacleFactor="1" fontMinPixelSize="0" mergeLines="0"/>
      <dd_properties>
        <Option type="Map">
          <Option type="QString" name="name" value=""/>
          <Option type="Map" name="properties">
            <Option type="Map" name="Color">
              <Option type="bool" name="active" value="true"/>
              <Option type="QString" name="expression" value="if((CASE WHEN &quot;rev_flag&quot; IN ('reject', 'merge', 'stem') THEN NULL ELSE coalesce(&quot;rev_dbh_cm&quot;, &quot;dbh_cm&quot;) END) IS NULL, '#7a7a7a', '#1b1b1b')"/>
              <Option type="int" name="type" value="3"/>
            </Option>
            <Option type="Map" name="Priority">
              <Option type="bool" name="active" value="true"/>
              <Option type="QString" name="expression" value="if((CASE WHEN &quot;rev_flag&quot; IN ('reject', 'merge', 'stem') THEN NULL ELSE coalesce(&quot;rev_dbh_cm&quot;, &quot;dbh_cm&quot;) END) IS NULL, 2, 10)"/>
              <Option type="int" name="type" value="3"/>
            </Option>
          </Option>
          <Option type="QString" name="type" value="collection"/>
        </Option>
      </dd_properties>
      <callout type="simple">
        <Option type="Map">
          <Option type="QString" name="anchorPoint" value="pole_of_inaccessibility"/>
          <Option type="int" name="blendMode" value="0"/>
          <Option type="Map" name="ddProperties">
            <Option type="QString" name="name" value=""/>
            <Option name="properties"/>
            <Option type="QString" name="type" value="collection"/>
          </Option>
          <Option type="bool" name="drawToAllParts" value="false"/>
          <Option type="QString" name="enabled" value="0"/>
          <Option type="QString" name="labelAnchorPoint" value="point_on_exterior"/>
          <Option type="QString" name="lineSymbol" value="&lt;symbol type=&quot;line&quot; force_rhr=&quot;0&quot; clip_to_extent=&quot;1&quot; alpha=&quot;1&quot; name=&quot;symbol&quot;>&lt;data_defined_properties>&lt;Option type=&quot;Map&quot;>&lt;Option type=&quot;QString&quot; name=&quot;name&quot; value=&quot;&quot;/>&lt;Option name=&quot;properties&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;type&quot; value=&quot;collection&quot;/>&lt;/Option>&lt;/data_defined_properties>&lt;layer class=&quot;SimpleLine&quot; enabled=&quot;1&quot; locked=&quot;0&quot; pass=&quot;0&quot;>&lt;Option type=&quot;Map&quot;>&lt;Option type=&quot;QString&quot; name=&quot;align_dash_pattern&quot; value=&quot;0&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;capstyle&quot; value=&quot;square&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;customdash&quot; value=&quot;5;2&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;customdash_map_unit_scale&quot; value=&quot;3x:0,0,0,0,0,0&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;customdash_unit&quot; value=&quot;MM&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;dash_pattern_offset&quot; value=&quot;0&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;dash_pattern_offset_map_unit_scale&quot; value=&quot;3x:0,0,0,0,0,0&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;dash_pattern_offset_unit&quot; value=&quot;MM&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;draw_inside_polygon&quot; value=&quot;0&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;joinstyle&quot; value=&quot;bevel&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;line_color&quot; value=&quot;60,60,60,255&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;line_style&quot; value=&quot;solid&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;line_width&quot; value=&quot;0.3&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;line_width_unit&quot; value=&quot;MM&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;offset&quot; value=&quot;0&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;offset_map_unit_scale&quot; value=&quot;3x:0,0,0,0,0,0&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;offset_unit&quot; value=&quot;MM&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;ring_filter&quot; value=&quot;0&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;trim_distance_end&quot; value=&quot;0&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;trim_distance_end_map_unit_scale&quot; value=&quot;3x:0,0,0,0,0,0&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;trim_distance_end_unit&quot; value=&quot;MM&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;trim_distance_start&quot; value=&quot;0&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;trim_distance_start_map_unit_scale&quot; value=&quot;3x:0,0,0,0,0,0&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;trim_distance_start_unit&quot; value=&quot;MM&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;tweak_dash_pattern_on_corners&quot; value=&quot;0&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;use_custom_dash&quot; value=&quot;0&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;width_map_unit_scale&quot; value=&quot;3x:0,0,0,0,0,0&quot;/>&lt;/Option>&lt;prop k=&quot;align_dash_pattern&quot; v=&quot;0&quot;/>&lt;prop k=&quot;capstyle&quot; v=&quot;square&quot;/>&lt;prop k=&quot;customdash&quot; v=&quot;5;2&quot;/>&lt;prop k=&quot;customdash_map_unit_scale&quot; v=&quot;3x:0,0,0,0,0,0&quot;/>&lt;prop k=&quot;customdash_unit&quot; v=&quot;MM&quot;/>&lt;prop k=&quot;dash_pattern_offset&quot; v=&quot;0&quot;/>&lt;prop k=&quot;dash_pattern_offset_map_unit_scale&quot; v=&quot;3x:0,0,0,0,0,0&quot;/>&lt;prop k=&quot;dash_pattern_offset_unit&quot; v=&quot;MM&quot;/>&lt;prop k=&quot;draw_inside_polygon&quot; v=&quot;0&quot;/>&lt;prop k=&quot;joinstyle&quot; v=&quot;bevel&quot;/>&lt;prop k=&quot;line_color&quot; v=&quot;60,60,60,255&quot;/>&lt;prop k=&quot;line_style&quot; v=&quot;solid&quot;/>&lt;prop k=&quot;line_width&quot; v=&quot;0.3&quot;/>&lt;prop k=&quot;line_width_unit&quot; v=&quot;MM&quot;/>&lt;prop k=&quot;offset&quot; v=&quot;0&quot;/>&lt;prop k=&quot;offset_map_unit_scale&quot; v=&quot;3x:0,0,0,0,0,0&quot;/>&lt;prop k=&quot;offset_unit&quot; v=&quot;MM&quot;/>&lt;prop k=&quot;ring_filter&quot; v=&quot;0&quot;/>&lt;prop k=&quot;trim_distance_end&quot; v=&quot;0&quot;/>&lt;prop k=&quot;trim_distance_end_map_unit_scale&quot; v=&quot;3x:0,0,0,0,0,0&quot;/>&lt;prop k=&quot;trim_distance_end_unit&quot; v=&quot;MM&quot;/>&lt;prop k=&quot;trim_distance_start&quot; v=&quot;0&quot;/>&lt;prop k=&quot;trim_distance_start_map_unit_scale&quot; v=&quot;3x:0,0,0,0,0,0&quot;/>&lt;prop k=&quot;trim_distance_start_unit&quot; v=&quot;MM&quot;/>&lt;prop k=&quot;tweak_dash_pattern_on_corners&quot; v=&quot;0&quot;/>&lt;prop k=&quot;use_custom_dash&quot; v=&quot;0&quot;/>&lt;prop k=&quot;width_map_unit_scale&quot; v=&quot;3x:0,0,0,0,0,0&quot;/>&lt;data_defined_properties>&lt;Option type=&quot;Map&quot;>&lt;Option type=&quot;QString&quot; name=&quot;name&quot; value=&quot;&quot;/>&lt;Option name=&quot;properties&quot;/>&lt;Option type=&quot;QString&quot; name=&quot;type&quot; value=&quot;collection&quot;/>&lt;/Option>&lt;/data_defined_properties>&lt;/layer>&lt;/symbol>"/>
          <Option type="double" name="minLength" value="0"/>
          <Option type="QString" name="minLengthMapUnitScale" value="3x:0,0,0,0,0,0"/>
          <Option type="QString" name="minLengthUnit" value="MM"/>
          <Option type="double" name="offsetFromAnchor" value="0"/>
          <Option type="QString" name="offsetFromAnchorMapUnitScale" value="3x:0,0,0,0,0,0"/>
          <Option type="QString" name="offsetFromAnchorUnit" value="MM"/>
          <Option type="double" name="offsetFromLabel" value="0"/>
          <Option type="QString" name="offsetFromLabelMapUnitScale" value="3x:0,0,0,0,0,0"/>
          <Option type="QString" name="offsetFromLabelUnit" value="MM"/>
        </Option>
      </callout>
    </settings>
  </labeling>
  <blendMode>0</blendMode>
  <featureBlendMode>0</featureBlendMode>
  <layerOpacity>1</layerOpacity>
  <fieldConfiguration>
    <field name="tree_id" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="plot_id" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="x" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="y" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="z_ground" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="dbh_cm" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="dbh_se_cm" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="dbh_lo_cm" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="dbh_hi_cm" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="bh_m" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="height_m" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="height_se_m" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="height_why" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="ba_m2" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="lean_deg" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="arc_deg" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="n_pts" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="n_views" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="n_slices" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="opac_mean" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="taper_cm_m" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="method" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="qc_flag" configurationFlags="None">
      <editWidget type="ValueMap">
        <config>
          <Option type="Map">
            <Option type="List" name="map">
              <Option type="Map">
                <Option type="QString" name="measured" value="ok"/>
              </Option>
              <Option type="Map">
                <Option type="QString" name="measured, to be checked" value="check"/>
              </Option>
              <Option type="Map">
                <Option type="QString" name="seen, no DBH" value="reject"/>
              </Option>
            </Option>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="qc_reason" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="run_id" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="species" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="status" configurationFlags="None">
      <editWidget type="ValueMap">
        <config>
          <Option type="Map">
            <Option type="List" name="map">
              <Option type="Map">
                <Option type="QString" name="not said" value="{2839923C-8B7D-419E-B84B-CA2FE9B80EC7}"/>
              </Option>
              <Option type="Map">
                <Option type="QString" name="live" value="live"/>
              </Option>
              <Option type="Map">
                <Option type="QString" name="dead" value="dead"/>
              </Option>
            </Option>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="note" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" name="IsMultiline" value="true"/>
            <Option type="bool" name="UseHtml" value="false"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="rev_flag" configurationFlags="None">
      <editWidget type="ValueMap">
        <config>
          <Option type="Map">
            <Option type="List" name="map">
              <Option type="Map">
                <Option type="QString" name="not decided" value="{2839923C-8B7D-419E-B84B-CA2FE9B80EC7}"/>
              </Option>
              <Option type="Map">
                <Option type="QString" name="accepted" value="accept"/>
              </Option>
              <Option type="Map">
                <Option type="QString" name="no tree stands here" value="reject"/>
              </Option>
              <Option type="Map">
                <Option type="QString" name="taped" value="dbh"/>
              </Option>
              <Option type="Map">
                <Option type="QString" name="the same tree as another" value="merge"/>
              </Option>
              <Option type="Map">
                <Option type="QString" name="a stem stands here, DBH unknown" value="stem"/>
              </Option>
            </Option>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="rev_dbh_cm" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="rev_note" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="rev_by" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="rev_at" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="fid" configurationFlags="None">
      <editWidget type="Hidden">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
  </fieldConfiguration>
  <aliases>
    <alias name="Tree" field="tree_id" index="0"/>
    <alias name="Plot" field="plot_id" index="1"/>
    <alias name="Easting at breast height [m]" field="x" index="2"/>
    <alias name="Northing at breast height [m]" field="y" index="3"/>
    <alias name="Ground height [m]" field="z_ground" index="4"/>
    <alias name="DBH [cm]" field="dbh_cm" index="5"/>
    <alias name="DBH standard error [cm]" field="dbh_se_cm" index="6"/>
    <alias name="DBH, lower end of 90 % interval [cm]" field="dbh_lo_cm" index="7"/>
    <alias name="DBH, upper end of 90 % interval [cm]" field="dbh_hi_cm" index="8"/>
    <alias name="Breast height used [m]" field="bh_m" index="9"/>
    <alias name="Tree height [m]" field="height_m" index="10"/>
    <alias name="Tree height, standard error [m]" field="height_se_m" index="11"/>
    <alias name="Why there is no height" field="height_why" index="12"/>
    <alias name="Basal area [m²]" field="ba_m2" index="13"/>
    <alias name="Lean [°]" field="lean_deg" index="14"/>
    <alias name="Stem circumference seen [°]" field="arc_deg" index="15"/>
    <alias name="Stem points" field="n_pts" index="16"/>
    <alias name="Photos that see the stem" field="n_views" index="17"/>
    <alias name="Slices fitted" field="n_slices" index="18"/>
    <alias name="Mean opacity (0-1)" field="opac_mean" index="19"/>
    <alias name="Taper [cm/m]" field="taper_cm_m" index="20"/>
    <alias name="Method" field="method" index="21"/>
    <alias name="Quality" field="qc_flag" index="22"/>
    <alias name="Reasons" field="qc_reason" index="23"/>
    <alias name="Run" field="run_id" index="24"/>
    <alias name="Species" field="species" index="25"/>
    <alias name="Live or dead" field="status" index="26"/>
    <alias name="Note" field="note" index="27"/>
    <alias name="Decision" field="rev_flag" index="28"/>
    <alias name="Taped DBH [cm]" field="rev_dbh_cm" index="29"/>
    <alias name="Why" field="rev_note" index="30"/>
    <alias name="Decided by" field="rev_by" index="31"/>
    <alias name="Decided at (UTC)" field="rev_at" index="32"/>
    <alias name="" field="fid" index="33"/>
  </aliases>
  <defaults>
    <default expression="" field="tree_id" applyOnUpdate="0"/>
    <default expression="" field="plot_id" applyOnUpdate="0"/>
    <default expression="" field="x" applyOnUpdate="0"/>
    <default expression="" field="y" applyOnUpdate="0"/>
    <default expression="" field="z_ground" applyOnUpdate="0"/>
    <default expression="" field="dbh_cm" applyOnUpdate="0"/>
    <default expression="" field="dbh_se_cm" applyOnUpdate="0"/>
    <default expression="" field="dbh_lo_cm" applyOnUpdate="0"/>
    <default expression="" field="dbh_hi_cm" applyOnUpdate="0"/>
    <default expression="" field="bh_m" applyOnUpdate="0"/>
    <default expression="" field="height_m" applyOnUpdate="0"/>
    <default expression="" field="height_se_m" applyOnUpdate="0"/>
    <default expression="" field="height_why" applyOnUpdate="0"/>
    <default expression="" field="ba_m2" applyOnUpdate="0"/>
    <default expression="" field="lean_deg" applyOnUpdate="0"/>
    <default expression="" field="arc_deg" applyOnUpdate="0"/>
    <default expression="" field="n_pts" applyOnUpdate="0"/>
    <default expression="" field="n_views" applyOnUpdate="0"/>
    <default expression="" field="n_slices" applyOnUpdate="0"/>
    <default expression="" field="opac_mean" applyOnUpdate="0"/>
    <default expression="" field="taper_cm_m" applyOnUpdate="0"/>
    <default expression="" field="method" applyOnUpdate="0"/>
    <default expression="" field="qc_flag" applyOnUpdate="0"/>
    <default expression="" field="qc_reason" applyOnUpdate="0"/>
    <default expression="" field="run_id" applyOnUpdate="0"/>
    <default expression="" field="species" applyOnUpdate="0"/>
    <default expression="" field="status" applyOnUpdate="0"/>
    <default expression="" field="note" applyOnUpdate="0"/>
    <default expression="" field="rev_flag" applyOnUpdate="0"/>
    <default expression="" field="rev_dbh_cm" applyOnUpdate="0"/>
    <default expression="" field="rev_note" applyOnUpdate="0"/>
    <default expression="" field="rev_by" applyOnUpdate="0"/>
    <default expression="" field="rev_at" applyOnUpdate="0"/>
    <default expression="" field="fid" applyOnUpdate="0"/>
  </defaults>
  <constraints>
    <constraint unique_strength="0" exp_strength="0" field="tree_id" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="plot_id" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="x" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="y" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="z_ground" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="dbh_cm" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="dbh_se_cm" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="dbh_lo_cm" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="dbh_hi_cm" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="bh_m" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="height_m" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="height_se_m" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="height_why" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="ba_m2" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="lean_deg" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="arc_deg" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="n_pts" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="n_views" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="n_slices" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="opac_mean" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="taper_cm_m" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="method" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="qc_flag" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="qc_reason" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="run_id" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="species" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="status" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="note" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="rev_flag" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="rev_dbh_cm" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="rev_note" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="rev_by" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="rev_at" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="fid" notnull_strength="0" constraints="0"/>
  </constraints>
  <constraintExpressions>
    <constraint desc="" field="tree_id" exp=""/>
    <constraint desc="" field="plot_id" exp=""/>
    <constraint desc="" field="x" exp=""/>
    <constraint desc="" field="y" exp=""/>
    <constraint desc="" field="z_ground" exp=""/>
    <constraint desc="" field="dbh_cm" exp=""/>
    <constraint desc="" field="dbh_se_cm" exp=""/>
    <constraint desc="" field="dbh_lo_cm" exp=""/>
    <constraint desc="" field="dbh_hi_cm" exp=""/>
    <constraint desc="" field="bh_m" exp=""/>
    <constraint desc="" field="height_m" exp=""/>
    <constraint desc="" field="height_se_m" exp=""/>
    <constraint desc="" field="height_why" exp=""/>
    <constraint desc="" field="ba_m2" exp=""/>
    <constraint desc="" field="lean_deg" exp=""/>
    <constraint desc="" field="arc_deg" exp=""/>
    <constraint desc="" field="n_pts" exp=""/>
    <constraint desc="" field="n_views" exp=""/>
    <constraint desc="" field="n_slices" exp=""/>
    <constraint desc="" field="opac_mean" exp=""/>
    <constraint desc="" field="taper_cm_m" exp=""/>
    <constraint desc="" field="method" exp=""/>
    <constraint desc="" field="qc_flag" exp=""/>
    <constraint desc="" field="qc_reason" exp=""/>
    <constraint desc="" field="run_id" exp=""/>
    <constraint desc="" field="species" exp=""/>
    <constraint desc="" field="status" exp=""/>
    <constraint desc="" field="note" exp=""/>
    <constraint desc="" field="rev_flag" exp=""/>
    <constraint desc="" field="rev_dbh_cm" exp=""/>
    <constraint desc="" field="rev_note" exp=""/>
    <constraint desc="" field="rev_by" exp=""/>
    <constraint desc="" field="rev_at" exp=""/>
    <constraint desc="" field="fid" exp=""/>
  </constraintExpressions>
  <expressionfields/>
  <attributetableconfig sortOrder="0" sortExpression="" actionWidgetStyle="dropDown">
    <columns>
      <column type="field" name="tree_id" hidden="0" width="70"/>
      <column type="field" name="plot_id" hidden="0" width="88"/>
      <column type="field" name="dbh_cm" hidden="0" width="70"/>
      <column type="field" name="dbh_se_cm" hidden="0" width="216"/>
      <column type="field" name="height_m" hidden="0" width="160"/>
      <column type="field" name="qc_flag" hidden="0" width="70"/>
      <column type="field" name="qc_reason" hidden="0" width="70"/>
      <column type="field" name="species" hidden="0" width="70"/>
      <column type="field" name="status" hidden="0" width="120"/>
      <column type="field" name="x" hidden="0" width="240"/>
      <column type="field" name="y" hidden="0" width="248"/>
      <column type="field" name="z_ground" hidden="0" width="160"/>
      <column type="field" name="dbh_lo_cm" hidden="0" width="392"/>
      <column type="field" name="dbh_hi_cm" hidden="0" width="392"/>
      <column type="field" name="bh_m" hidden="0" width="208"/>
      <column type="field" name="height_se_m" hidden="0" width="288"/>
      <column type="field" name="height_why" hidden="0" width="192"/>
      <column type="field" name="ba_m2" hidden="0" width="128"/>
      <column type="field" name="lean_deg" hidden="0" width="120"/>
      <column type="field" name="arc_deg" hidden="0" width="280"/>
      <column type="field" name="n_pts" hidden="0" width="136"/>
      <column type="field" name="n_views" hidden="0" width="208"/>
      <column type="field" name="n_slices" hidden="0" width="152"/>
      <column type="field" name="opac_mean" hidden="0" width="192"/>
      <column type="field" name="taper_cm_m" hidden="0" width="144"/>
      <column type="field" name="method" hidden="0" width="72"/>
      <column type="field" name="run_id" hidden="0" width="72"/>
      <column type="field" name="note" hidden="0" width="72"/>
      <column type="field" name="rev_flag" hidden="0" width="96"/>
      <column type="field" name="rev_dbh_cm" hidden="0" width="168"/>
      <column type="field" name="rev_note" hidden="0" width="70"/>
      <column type="field" name="rev_by" hidden="0" width="120"/>
      <column type="field" name="rev_at" hidden="0" width="160"/>
      <column type="field" name="fid" hidden="1" width="70"/>
      <column type="actions" hidden="0" width="70"/>
    </columns>
  </attributetableconfig>
  <conditionalstyles>
    <rowstyles/>
    <fieldstyles/>
  </conditionalstyles>
  <storedexpressions/>
  <editform tolerant="1"></editform>
  <editforminit/>
  <editforminitcodesource>0</editforminitcodesource>
  <editforminitfilepath></editforminitfilepath>
  <editforminitcode><![CDATA[]]></editforminitcode>
  <featformsuppress>0</featformsuppress>
  <editorlayout>tablayout</editorlayout>
  <attributeEditorForm>
    <attributeEditorContainer groupBox="1" visibilityExpressionEnabled="0" name="Yours to write" visibilityExpression="" showLabel="1" columnCount="1">
      <attributeEditorField name="rev_flag" showLabel="1" index="28"/>
      <attributeEditorField name="rev_dbh_cm" showLabel="1" index="29"/>
      <attributeEditorField name="rev_note" showLabel="1" index="30"/>
      <attributeEditorField name="rev_by" showLabel="1" index="31"/>
      <attributeEditorField name="rev_at" showLabel="1" index="32"/>
      <attributeEditorField name="species" showLabel="1" index="25"/>
      <attributeEditorField name="status" showLabel="1" index="26"/>
      <attributeEditorField name="note" showLabel="1" index="27"/>
    </attributeEditorContainer>
    <attributeEditorContainer groupBox="1" visibilityExpressionEnabled="0" name="Measured" visibilityExpression="" showLabel="1" columnCount="1">
      <attributeEditorField name="tree_id" showLabel="1" index="0"/>
      <attributeEditorField name="plot_id" showLabel="1" index="1"/>
      <attributeEditorField name="x" showLabel="1" index="2"/>
      <attributeEditorField name="y" showLabel="1" index="3"/>
      <attributeEditorField name="z_ground" showLabel="1" index="4"/>
      <attributeEditorField name="dbh_cm" showLabel="1" index="5"/>
      <attributeEditorField name="dbh_se_cm" showLabel="1" index="6"/>
      <attributeEditorField name="dbh_lo_cm" showLabel="1" index="7"/>
      <attributeEditorField name="dbh_hi_cm" showLabel="1" index="8"/>
      <attributeEditorField name="bh_m" showLabel="1" index="9"/>
      <attributeEditorField name="height_m" showLabel="1" index="10"/>
      <attributeEditorField name="height_se_m" showLabel="1" index="11"/>
      <attributeEditorField name="height_why" showLabel="1" index="12"/>
      <attributeEditorField name="ba_m2" showLabel="1" index="13"/>
      <attributeEditorField name="lean_deg" showLabel="1" index="14"/>
      <attributeEditorField name="arc_deg" showLabel="1" index="15"/>
      <attributeEditorField name="n_pts" showLabel="1" index="16"/>
      <attributeEditorField name="n_views" showLabel="1" index="17"/>
      <attributeEditorField name="n_slices" showLabel="1" index="18"/>
      <attributeEditorField name="opac_mean" showLabel="1" index="19"/>
      <attributeEditorField name="taper_cm_m" showLabel="1" index="20"/>
      <attributeEditorField name="method" showLabel="1" index="21"/>
      <attributeEditorField name="qc_flag" showLabel="1" index="22"/>
      <attributeEditorField name="qc_reason" showLabel="1" index="23"/>
      <attributeEditorField name="run_id" showLabel="1" index="24"/>
    </attributeEditorContainer>
  </attributeEditorForm>
  <editable>
    <field editable="1" name="arc_deg"/>
    <field editable="1" name="ba_m2"/>
    <field editable="1" name="bh_m"/>
    <field editable="1" name="dbh_cm"/>
    <field editable="1" name="dbh_hi_cm"/>
    <field editable="1" name="dbh_lo_cm"/>
    <field editable="1" name="dbh_se_cm"/>
    <field editable="0" name="fid"/>
    <field editable="1" name="height_m"/>
    <field editable="1" name="height_se_m"/>
    <field editable="1" name="height_why"/>
    <field editable="1" name="lean_deg"/>
    <field editable="1" name="method"/>
    <field editable="1" name="n_pts"/>
    <field editable="1" name="n_slices"/>
    <field editable="1" name="n_views"/>
    <field editable="1" name="note"/>
    <field editable="1" name="opac_mean"/>
    <field editable="1" name="plot_id"/>
    <field editable="1" name="qc_flag"/>
    <field editable="1" name="qc_reason"/>
    <field editable="1" name="rev_at"/>
    <field editable="1" name="rev_by"/>
    <field editable="1" name="rev_dbh_cm"/>
    <field editable="1" name="rev_flag"/>
    <field editable="1" name="rev_note"/>
    <field editable="1" name="run_id"/>
    <field editable="1" name="species"/>
    <field editable="1" name="status"/>
    <field editable="1" name="taper_cm_m"/>
    <field editable="1" name="tree_id"/>
    <field editable="1" name="x"/>
    <field editable="1" name="y"/>
    <field editable="1" name="z_ground"/>
  </editable>
  <labelOnTop/>
  <reuseLastValue/>
  <dataDefinedFieldProperties/>
  <widgets/>
  <previewExpression>(CASE WHEN left(@qgis_locale, 2) = 'de' THEN 'Baum' WHEN left(@qgis_locale, 2) = 'es' THEN 'Árbol' ELSE 'Tree' END) || ' ' || "tree_id" || coalesce(': ' || format_number(round(CASE WHEN "rev_flag" IN ('reject', 'merge', 'stem') THEN NULL ELSE coalesce("rev_dbh_cm", "dbh_cm") END, 1), 1) || ' cm', ', ' || (CASE WHEN left(@qgis_locale, 2) = 'de' THEN 'kein BHD' WHEN left(@qgis_locale, 2) = 'es' THEN 'sin DAP' ELSE 'no DBH' END))</previewExpression>
  <mapTip>&lt;b>[% (CASE WHEN left(@qgis_locale, 2) = 'de' THEN 'Baum' WHEN left(@qgis_locale, 2) = 'es' THEN 'Árbol' ELSE 'Tree' END) %] [% "tree_id" %][% coalesce(', ' || (CASE WHEN left(@qgis_locale, 2) = 'de' THEN 'Fläche' WHEN left(@qgis_locale, 2) = 'es' THEN 'parcela' ELSE 'plot' END) || ' ' || replace(replace(replace("plot_id", '&amp;', '&amp;amp;'), '&lt;', '&amp;lt;'), '>', '&amp;gt;'), '') %]&lt;/b>&lt;br>[% CASE WHEN "dbh_cm" IS NULL THEN (CASE WHEN left(@qgis_locale, 2) = 'de' THEN 'Kein BHD' WHEN left(@qgis_locale, 2) = 'es' THEN 'Sin DAP' ELSE 'No DBH' END) ELSE (CASE WHEN left(@qgis_locale, 2) = 'de' THEN 'BHD' WHEN left(@qgis_locale, 2) = 'es' THEN 'DAP' ELSE 'DBH' END) || ' &lt;b>' || format_number(round("dbh_cm", 1), 1) || '&lt;/b>' || coalesce(' ± ' || format_number(round("dbh_se_cm", 1), 1), '') || ' cm' || coalesce(' ' || (CASE WHEN left(@qgis_locale, 2) = 'de' THEN 'in' WHEN left(@qgis_locale, 2) = 'es' THEN 'a' ELSE 'at' END) || ' ' || format_number("bh_m", 2) || ' m', '') || coalesce('&lt;br>90 %: ' || format_number(round("dbh_lo_cm", 1), 1) || ' – ' || format_number(round("dbh_hi_cm", 1), 1) || ' cm', '') END %][% coalesce('&lt;br>' || (CASE WHEN left(@qgis_locale, 2) = 'de' THEN 'Höhe' WHEN left(@qgis_locale, 2) = 'es' THEN 'altura' ELSE 'height' END) || ' ' || format_number(round("height_m", 1), 1) || coalesce(' ± ' || format_number(round("height_se_m", 1), 1), '') || ' m', '') %][% CASE WHEN coalesce(replace(replace(replace("qc_reason", '&amp;', '&amp;amp;'), '&lt;', '&amp;lt;'), '>', '&amp;gt;'), '') &lt;> '' THEN '&lt;br>&lt;i>' || array_to_string(array_foreach(string_to_array(coalesce(replace(replace(replace("qc_reason", '&amp;', '&amp;amp;'), '&lt;', '&amp;lt;'), '>', '&amp;gt;'), '')), coalesce(map_get((CASE WHEN left(@qgis_locale, 2) = 'de' THEN map('few_views', 'zu wenige Fotos sehen den Stamm in Brusthöhe: mehr Schrägfotos über diesem Teil der Probefläche aufnehmen', 'occluded', 'Laub oder andere Stämme verdecken den Stamm in Brusthöhe: laubfrei oder aus anderen Richtungen fliegen', 'ambiguous', 'zwei verschiedene Stämme erklären die Fotos gleich gut: Fotos ansehen oder von Hand messen', 'covered', 'Efeu oder anderer Bewuchs bedeckt die Rinde in Brusthöhe: darunter von Hand messen; was zu sehen ist, ist dicker als der Stamm', 'double', 'die Rinde ist doppelt zu sehen: zwei Zeitpunkte in einer Wolke oder Scans, die nicht zusammenpassen: geben Sie die Scans eines Zeitpunkts, aufeinander registriert', 'see_through', 'Fotos zeigen den Boden oder keine Rinde, wo der Stamm stehen müsste: dort liegt wohl anderes in einer Linie: in seinen Fotos oder vor Ort nachsehen; vielleicht steht dort kein Stamm', 'short_arc', 'die Punkte decken zu wenig vom Umfang des Stamms ab: von mehr Seiten scannen oder fliegen', 'few_points', 'zu wenige Stammpunkte am unteren Stamm: die Punktdichte erhöhen', 'few_slices', 'zu wenige Scheiben des Stamms ergaben einen Kreis: die Punktdichte erhöhen', 'not_round', 'der Querschnitt ist kein Kreis (Wurzelanläufe, Zwiesel oder mehrere Stämme): von Hand messen', 'no_taper', 'die Durchmesser am Stamm bilden keine glaubhafte Verjüngung: den Stamm auf Äste oder einen Zwiesel prüfen', 'lean', 'der Stamm ist stärker geneigt, als das Verfahren zulässt: von Hand messen', 'merged', 'zwei Stämme können für einen gehalten worden sein: die Segmentierung prüfen', 'too_small', 'der Stamm ist dünner, als Fotos oder Punkte auflösen können: tiefer fliegen oder näher scannen', 'too_large', 'der angepasste Stamm ist dicker als das erlaubte Höchstmaß: den größten Durchmesser erhöhen, wenn er echt ist', 'too_short', 'der Baum ist viel niedriger als die anderen seines Durchmessers: Durchmesser prüfen, und ob der Wipfel gebrochen ist', 'wide_error', 'der geschätzte Fehler ist zu groß, um nützlich zu sein: mehr Fotos aufnehmen oder von Hand messen', 'carried_down', 'Brusthöhe ist verdeckt: 2 bis 5 m über dem Boden gemessen und mit der Abholzigkeit der Stämme der Probefläche herabgeführt: prüfen, oder von Hand messen, wo der Zehntelzentimeter zählt', 'disagree', 'zwei Messverfahren widersprechen sich: diesen Baum von Hand prüfen', 'unchecked', 'das veröffentlichte Verfahren hat keine eigene Prüfung und keinen eigenen Fehler: mit dem Standardverfahren vergleichen', 'no_ground', 'die Höhe des Bodens am Baum ist unbekannt oder unsicher: die Punktwolke mit ihrem Boden angeben, oder ein Geländemodell, das zu ihr passt', 'weak_block', 'die Fotos dieses Laufs passen kaum zusammen: Punkte der einen finden sich in anderen nicht dort, wo sie sein müssen: mit mehr Überlappung oder bei weniger Wind fliegen, oder von Hand prüfen', 'odd_heights', 'die Bäume sind höher, als Bäume ihres Durchmessers sind: die Höhen können in Fuß sein: die Einheit der Höhen in der Punktwolke prüfen und neu messen', 'not_found', 'ein Mensch sagt, dass hier ein Stamm steht, aber es wurde keiner gefunden: an seinem Ort in den Fotos messen oder mit dem Band', 'edge', 'der Baum steht am Rand der Daten: über die Probefläche hinaus aufnehmen') WHEN left(@qgis_locale, 2) = 'es' THEN map('few_views', 'muy pocas fotos ven el tronco a la altura del pecho: tome más fotos oblicuas sobre esta parte de la parcela', 'occluded', 'el follaje u otros troncos ocultan el tronco a la altura del pecho: vuele sin hojas o desde otras direcciones', 'ambiguous', 'dos troncos distintos explican igual de bien las fotos: revise las fotos o mida a mano', 'covered', 'hiedra u otra vegetación cubre la corteza a la altura del pecho: mida a mano por debajo; lo que se ve es más grueso que el fuste', 'double', 'la corteza se ve dos veces: dos fechas en una nube, o escaneos que no encajan: dé los escaneos de una fecha, registrados entre sí', 'see_through', 'las fotos muestran el suelo, o ninguna corteza, donde debería estar el tronco: puede que otras cosas queden alineadas allí: mírelo en sus fotos o en el terreno; puede que no haya ningún tronco', 'short_arc', 'los puntos cubren muy poco de la circunferencia del tronco: escanee o vuele desde más lados', 'few_points', 'muy pocos puntos en la parte baja del tronco: aumente la densidad de puntos', 'few_slices', 'muy pocas secciones del tronco dieron un círculo: aumente la densidad de puntos', 'not_round', 'la sección no es un círculo (contrafuerte, horquilla o varios troncos): mida a mano', 'no_taper', 'los diámetros a lo largo del tronco no forman un ahusamiento verosímil: compruebe si el tronco tiene ramas o una horquilla', 'lean', 'el tronco se inclina más de lo que admite el método: mida a mano', 'merged', 'dos troncos pueden haberse tomado por uno: revise la segmentación', 'too_small', 'el tronco es más fino de lo que resuelven las fotos o los puntos: vuele más bajo o escanee más cerca', 'too_large', 'el tronco ajustado es más grueso que el máximo permitido: suba el diámetro máximo si es real', 'too_short', 'el árbol es mucho más bajo que los demás de su diámetro: comprobar el diámetro y si la copa está rota', 'wide_error', 'el error estimado es demasiado grande para ser útil: tome más fotos o mida a mano', 'carried_down', 'la altura del pecho está oculta: medido de 2 a 5 m sobre el suelo y llevado hacia abajo con el ahusamiento de los troncos de la parcela: comprobar, o medir a mano donde cuente el milímetro', 'disagree', 'dos métodos de medición no coinciden: compruebe este árbol a mano', 'unchecked', 'el método publicado no tiene comprobación ni error propios: compare con el método por defecto', 'no_ground', 'la altura del suelo en el árbol es desconocida o insegura: dé la nube con su suelo, o un MDT que encaje con ella', 'weak_block', 'las fotos de esta ejecución apenas encajan entre sí: los puntos de unas no se encuentran donde deben estar en otras: vuele con más solape o con menos viento, o compruebe a mano', 'odd_heights', 'los árboles son más altos que los de su diámetro: las alturas pueden estar en pies: compruebe la unidad de las alturas de la nube y mida de nuevo', 'not_found', 'una persona dice que aquí hay un fuste, pero no se encontró ninguno: medirlo en su lugar en las fotos o con cinta', 'edge', 'el árbol está en el borde de los datos: amplíe el vuelo más allá de la parcela') ELSE map('few_views', 'too few photos see the stem at breast height: fly more oblique photos over this part of the plot', 'occluded', 'foliage or other stems hide the stem at breast height: fly leaf-off or from other directions', 'ambiguous', 'two different stems explain the photos equally well: check the photos or measure by hand', 'covered', 'ivy or other growth covers the bark at breast height: measure under it by hand; what is seen is thicker than the stem', 'double', 'the bark is seen twice: two dates in one cloud, or scans that do not fit together: give the scans of one date, registered to each other', 'see_through', 'photos show the ground, or no bark, where the stem should stand: other things may line up there: look at its photos or on site; there may be no stem', 'short_arc', 'the points cover too little of the stem''s circumference: scan or fly from more sides', 'few_points', 'too few stem points at the lower stem: raise the point density', 'few_slices', 'too few slices of the stem gave a circle: raise the point density', 'not_round', 'the cross-section is not a circle (buttress, fork or several stems): measure by hand', 'no_taper', 'diameters along the stem do not form a plausible taper: check the stem for branches or a fork', 'lean', 'the stem leans more than the method allows: measure by hand', 'merged', 'two stems may have been taken for one: check the segmentation', 'too_small', 'the stem is thinner than the photos or points can resolve: fly lower or scan closer', 'too_large', 'the fitted stem is thicker than the allowed maximum: raise the maximum diameter if it is real', 'too_short', 'the tree is far shorter than the others of its diameter: check the diameter, and whether the top is broken', 'wide_error', 'the estimated error is too large to be useful: fly more photos or measure by hand', 'carried_down', 'breast height is hidden: measured 2 to 5 m above the ground, carried down by the taper of the plot''s stems: check, or measure by hand where the tenth of a centimetre counts', 'disagree', 'two measuring methods disagree: check this tree by hand', 'unchecked', 'the published method has no check and no error of its own: compare with the default method', 'no_ground', 'the height of the ground at the tree is unknown or unsure: give the cloud with its ground, or a DTM that fits it', 'weak_block', 'the photos of this run hardly fit together: points of some are not found where they must be in others: fly with more overlap or in less wind, or check by hand', 'odd_heights', 'the trees are taller than trees of their diameter are: heights may be in feet: check the unit of the cloud''s heights and measure again', 'not_found', 'a person says that a stem stands here, but none was found: measure it at its place in the photos, or by tape', 'edge', 'the tree stands at the edge of the data: extend the survey beyond the plot') END), trim(@element)), trim(@element))), '&lt;br>') || '&lt;/i>' ELSE '' END %][% coalesce('&lt;br>' || replace(replace(replace("species", '&amp;', '&amp;amp;'), '&lt;', '&amp;lt;'), '>', '&amp;gt;'), '') %][% coalesce('&lt;br>' || replace(replace(replace("status", '&amp;', '&amp;amp;'), '&lt;', '&amp;lt;'), '>', '&amp;gt;'), '') %][% coalesce('&lt;br>' || replace(replace(replace("note", '&amp;', '&amp;amp;'), '&lt;', '&amp;lt;'), '>', '&amp;gt;'), '') %][% coalesce(with_variable('sheet', file_path(decode_uri(@layer_id, 'path')) || '/' || 'folder-of-the-sheets' || '/' || replace(replace(replace("run_id", '&amp;', '&amp;amp;'), '&lt;', '&amp;lt;'), '>', '&amp;gt;') || '/' || "tree_id" || '.jpg', CASE WHEN file_exists(@sheet) THEN '&lt;br>&lt;img width="500" src="' || 'file:///' || regexp_replace(replace(replace(replace(replace(replace(replace(replace(replace(replace(@sheet, '%', '%25'), '#', '%23'), '?', '%3F'), '"', '%22'), '''', '%27'), '&lt;', '%3C'), '>', '%3E'), '&amp;', '%26'), ' ', '%20'), '^/+', '') || '">' ELSE '' END), '') %]</mapTip>
  <layerGeometryType>0</layerGeometryType>
</qgis>
