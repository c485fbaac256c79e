<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis simplifyDrawingTol="1" labelsEnabled="0" simplifyLocal="1" simplifyDrawingHints="1" simplifyAlgorithm="0" simplifyMaxScale="1" symbologyReferenceScale="-1" minScale="100000000" version="3.22.16-Białowieża" styleCategories="LayerConfiguration|Symbology|Labeling|Fields|Forms|MapTips|AttributeTable|Rendering" hasScaleBasedVisibilityFlag="0" maxScale="0" readOnly="0">
  <flags>
    <Identifiable>1</Identifiable>
    <Removable>1</Removable>
    <Searchable>1</Searchable>
    <Private>0</Private>
  </flags>
  <renderer-v2 type="singleSymbol" referencescale="-1" enableorderby="0" forceraster="0" symbollevels="0">
    <symbols>
      <symbol type="line" force_rhr="0" clip_to_extent="1" alpha="1" name="0">
        <data_defined_properties>
          <Option type="Map">
            <Option type="QString" name="name" value=""/>
            <Option name="properties"/>
            <Option type="QString" name="type" value="collection"/>
          </Option>
        </data_defined_properties>
        <layer class="SimpleLine" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="align_dash_pattern" value="0"/>
            <Option type="QString" name="capstyle" value="square"/>
            <Option type="QString" name="customdash" value="5;2"/>
            <Option type="QString" name="customdash_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="customdash_unit" value="MM"/>
            <Option type="QString" name="dash_pattern_offset" value="0"/>
            <Option type="QString" name="dash_pattern_offset_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="dash_pattern_offset_unit" value="MM"/>
            <Option type="QString" name="draw_inside_polygon" value="0"/>
            <Option type="QString" name="joinstyle" value="bevel"/>
            <Option type="QString" name="line_color" value="106,61,154,255"/>
            <Option type="QString" name="line_style" value="dash"/>
            <Option type="QString" name="line_width" value="0.6"/>
            <Option type="QString" name="line_width_unit" value="MM"/>
            <Option type="QString" name="offset" value="0"/>
            <Option type="QString" name="offset_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="offset_unit" value="MM"/>
            <Option type="QString" name="ring_filter" value="0"/>
            <Option type="QString" name="trim_distance_end" value="0"/>
            <Option type="QString" name="trim_distance_end_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="trim_distance_end_unit" value="MM"/>
            <Option type="QString" name="trim_distance_start" value="0"/>
            <Option type="QString" name="trim_distance_start_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="trim_distance_start_unit" value="MM"/>
            <Option type="QString" name="tweak_dash_pattern_on_corners" value="0"/>
            <Option type="QString" name="use_custom_dash" value="0"/>
            <Option type="QString" name="width_map_unit_scale" value="3x:0,0,0,0,0,0"/>
          </Option>
          <prop k="align_dash_pattern" v="0"/>
          <prop k="capstyle" v="square"/>
          <prop k="customdash" v="5;2"/>
          <prop k="customdash_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="customdash_unit" v="MM"/>
          <prop k="dash_pattern_offset" v="0"/>
          <prop k="dash_pattern_offset_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="dash_pattern_offset_unit" v="MM"/>
          <prop k="draw_inside_polygon" v="0"/>
          <prop k="joinstyle" v="bevel"/>
          <prop k="line_color" v="106,61,154,255"/>
          <prop k="line_style" v="dash"/>
          <prop k="line_width" v="0.6"/>
          <prop k="line_width_unit" v="MM"/>
          <prop k="offset" v="0"/>
          <prop k="offset_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="offset_unit" v="MM"/>
          <prop k="ring_filter" v="0"/>
          <prop k="trim_distance_end" v="0"/>
          <prop k="trim_distance_end_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="trim_distance_end_unit" v="MM"/>
          <prop k="trim_distance_start" v="0"/>
          <prop k="trim_distance_start_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="trim_distance_start_unit" v="MM"/>
          <prop k="tweak_dash_pattern_on_corners" v="0"/>
          <prop k="use_custom_dash" v="0"/>
          <prop k="width_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <data_defined_properties>
            <Option type="Map">
              <Option type="QString" name="name" value=""/>
              <Option name="properties"/>
              <Option type="QString" name="type" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
    </symbols>
    <rotation/>
    <sizescale/>
  </renderer-v2>
  <blendMode>0</blendMode>
  <featureBlendMode>0</featureBlendMode>
  <layerOpacity>1</layerOpacity>
  <fieldConfiguration>
    <field name="plot_id" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="field_id" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="tree_id" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="field_cm" configurationFlags="None">
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
    <field name="delta_cm" configurationFlags="None">
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
    <field name="qc_flag" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="meas_cm" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="rev_flag" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="dist_m" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="margin" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="pair_status" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="note" configurationFlags="None">
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
    <alias name="Plot" field="plot_id" index="0"/>
    <alias name="Field tree" field="field_id" index="1"/>
    <alias name="Measured tree" field="tree_id" index="2"/>
    <alias name="Field DBH [cm]" field="field_cm" index="3"/>
    <alias name="Measured DBH [cm]" field="dbh_cm" index="4"/>
    <alias name="Measured - field DBH [cm]" field="delta_cm" index="5"/>
    <alias name="DBH, lower end of 90 % interval [cm]" field="dbh_lo_cm" index="6"/>
    <alias name="DBH, upper end of 90 % interval [cm]" field="dbh_hi_cm" index="7"/>
    <alias name="Quality" field="qc_flag" index="8"/>
    <alias name="DBH as measured [cm]" field="meas_cm" index="9"/>
    <alias name="Decision" field="rev_flag" index="10"/>
    <alias name="Distance after co-registration [m]" field="dist_m" index="11"/>
    <alias name="Log-odds against the next best pairing" field="margin" index="12"/>
    <alias name="Pair status" field="pair_status" index="13"/>
    <alias name="Note" field="note" index="14"/>
    <alias name="" field="fid" index="15"/>
  </aliases>
  <defaults>
    <default expression="" field="plot_id" applyOnUpdate="0"/>
    <default expression="" field="field_id" applyOnUpdate="0"/>
    <default expression="" field="tree_id" applyOnUpdate="0"/>
    <default expression="" field="field_cm" applyOnUpdate="0"/>
    <default expression="" field="dbh_cm" applyOnUpdate="0"/>
    <default expression="" field="delta_cm" applyOnUpdate="0"/>
    <default expression="" field="dbh_lo_cm" applyOnUpdate="0"/>
    <default expression="" field="dbh_hi_cm" applyOnUpdate="0"/>
    <default expression="" field="qc_flag" applyOnUpdate="0"/>
    <default expression="" field="meas_cm" applyOnUpdate="0"/>
    <default expression="" field="rev_flag" applyOnUpdate="0"/>
    <default expression="" field="dist_m" applyOnUpdate="0"/>
    <default expression="" field="margin" applyOnUpdate="0"/>
    <default expression="" field="pair_status" applyOnUpdate="0"/>
    <default expression="" field="note" applyOnUpdate="0"/>
    <default expression="" field="fid" applyOnUpdate="0"/>
  </defaults>
  <constraints>
    <constraint unique_strength="0" exp_strength="0" field="plot_id" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="field_id" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="tree_id" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="field_cm" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="dbh_cm" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="delta_cm" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="dbh_lo_cm" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="dbh_hi_cm" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="qc_flag" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="meas_cm" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="rev_flag" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="dist_m" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="margin" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="pair_status" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="note" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="fid" notnull_strength="0" constraints="0"/>
  </constraints>
  <constraintExpressions>
    <constraint desc="" field="plot_id" exp=""/>
    <constraint desc="" field="field_id" exp=""/>
    <constraint desc="" field="tree_id" exp=""/>
    <constraint desc="" field="field_cm" exp=""/>
    <constraint desc="" field="dbh_cm" exp=""/>
    <constraint desc="" field="delta_cm" exp=""/>
    <constraint desc="" field="dbh_lo_cm" exp=""/>
    <constraint desc="" field="dbh_hi_cm" exp=""/>
    <constraint desc="" field="qc_flag" exp=""/>
    <constraint desc="" field="meas_cm" exp=""/>
    <constraint desc="" field="rev_flag" exp=""/>
    <constraint desc="" field="dist_m" exp=""/>
    <constraint desc="" field="margin" exp=""/>
    <constraint desc="" field="pair_status" exp=""/>
    <constraint desc="" field="note" exp=""/>
    <constraint desc="" field="fid" exp=""/>
  </constraintExpressions>
  <expressionfields/>
  <attributetableconfig sortOrder="0" sortExpression="" actionWidgetStyle="dropDown">
    <columns>
      <column type="field" name="plot_id" hidden="0" width="88"/>
      <column type="field" name="field_id" hidden="0" width="112"/>
      <column type="field" name="tree_id" hidden="0" width="120"/>
      <column type="field" name="field_cm" hidden="0" width="136"/>
      <column type="field" name="dbh_cm" hidden="0" width="152"/>
      <column type="field" name="delta_cm" hidden="0" width="208"/>
      <column type="field" name="dbh_lo_cm" hidden="0" width="392"/>
      <column type="field" name="dbh_hi_cm" hidden="0" width="392"/>
      <column type="field" name="qc_flag" hidden="0" width="70"/>
      <column type="field" name="meas_cm" hidden="0" width="168"/>
      <column type="field" name="rev_flag" hidden="0" width="96"/>
      <column type="field" name="dist_m" hidden="0" width="272"/>
      <column type="field" name="margin" hidden="0" width="456"/>
      <column type="field" name="pair_status" hidden="0" width="128"/>
      <column type="field" name="note" hidden="0" width="72"/>
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
  <editorlayout>generatedlayout</editorlayout>
  <editable>
    <field editable="1" name="dbh_cm"/>
    <field editable="1" name="dbh_hi_cm"/>
    <field editable="1" name="dbh_lo_cm"/>
    <field editable="1" name="delta_cm"/>
    <field editable="1" name="dist_m"/>
    <field editable="0" name="fid"/>
    <field editable="1" name="field_cm"/>
    <field editable="1" name="field_id"/>
    <field editable="1" name="margin"/>
    <field editable="1" name="meas_cm"/>
    <field editable="1" name="note"/>
    <field editable="1" name="pair_status"/>
    <field editable="1" name="plot_id"/>
    <field editable="1" name="qc_flag"/>
    <field editable="1" name="rev_flag"/>
    <field editable="1" name="tree_id"/>
  </editable>
  <labelOnTop/>
  <reuseLastValue/>
  <dataDefinedFieldProperties/>
  <widgets/>
  <previewExpression>"plot_id" || ': ' || "field_id" || ' - ' || "tree_id"</previewExpression>
  <mapTip>[% (CASE WHEN left(@qgis_locale, 2) = 'de' THEN 'Feldbaum' WHEN left(@qgis_locale, 2) = 'es' THEN 'Árbol de campo' ELSE 'Field tree' END) %] [% replace(replace(replace("field_id", '&amp;', '&amp;amp;'), '&lt;', '&amp;lt;'), '>', '&amp;gt;') %], [% (CASE WHEN left(@qgis_locale, 2) = 'de' THEN 'gemessener Baum' WHEN left(@qgis_locale, 2) = 'es' THEN 'árbol medido' ELSE 'measured tree' END) %] [% "tree_id" %]?[% coalesce('&lt;br>' || replace(replace(replace("note", '&amp;', '&amp;amp;'), '&lt;', '&amp;lt;'), '>', '&amp;gt;'), '') %]</mapTip>
  <layerGeometryType>1</layerGeometryType>
</qgis>
